"""The same bits on every processor. numpy, OpenBLAS and libm choose their kernels by its instructions,
and these round differently: what is shipped, drawn by a seed or stepped by the rigid engine is made of
+ − × ÷ √ in a fixed order, or rounded where it is not. All else is compared with a tolerance."""

import ast
import hashlib
import json
import re
import tempfile
from pathlib import Path

from numpy._core import _multiarray_umath as compiled

from analysis.engines.programs import rigid
from analysis.scene import Crowd, read_scene, room
from analysis.scene.anthropometry import Varied
from analysis.scene.shipped_scenes import MAKERS, make, variant
from analysis.scene.waiting import opposing
from analysis.studies.explore.page import content_of
from benchmarks.problems.families import FAMILIES
from nscd import ContactLaw, solve
from tests.forked import ROOT, python

# What processors or libraries round differently, as attributes of modules and arrays; ** and @ too.
NAMED = re.compile(
    "hypot|exp|expm1|log|log2|log10|log1p|a?(sin|cos|tan)h?|arc(sin|cos|tan)h?|a(rc)?tan2|power|float_power|pow|cbrt|dot|"
    "vdot|vecdot|einsum|matmul|tensordot|linalg|lstsq|norm|lognormal|exponential|standard_normal|gamma"
)
MADE_EXACTLY = """analysis/scene/**/*.py analysis/studies/explore/*.py analysis/engines/rigid.py analysis/engines/record.py
    analysis/engines/programs/rigid.py benchmarks/problems/families.py nscd/stepping/*.py nscd/[ab]*.py
    nscd/segments.py nscd/contacts.py nscd/laws.py nscd/solve_frames.py nscd/solve.py"""
# Force laws of soft bodies, fields and social forces, how people look: numbers that are shown, or compared
# with a tolerance.
SHOWN = {"law.py", "plausible.py", "coarse_grain.cpp", "soft.cpp"}
OF_LIBM = re.compile(r"std::(pow|hypot|exp|log|a?(sin|cos|tan)|cbrt|erf|fma)\w*\(")
CODE = "import json; from tests.test_rounding import made; print(json.dumps(made()))"


def dispatched():
    """The instructions that numpy chooses kernels by and this processor has."""
    return ",".join(one for one in compiled.__cpu_dispatch__ if compiled.__cpu_features__[one])


def rounded_differently(node):
    """Whether an expression may have another last digit on another processor."""
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Pow | ast.MatMult)
    drawn = isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "normal"
    return drawn or (isinstance(node, ast.Attribute) and NAMED.fullmatch(node.attr))


def test_what_must_be_exact_is_made_of_operations_that_are():
    """But for functions that say how far their numbers are those of every processor."""
    found = []
    for path in (path for name in MADE_EXACTLY.split() for path in ROOT.glob(name)):
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        parts = [part for part in ast.walk(tree) if isinstance(part, ast.FunctionDef)]
        says = [one for one in parts if "every processor" in str(ast.get_source_segment(text, one))]
        stated = {node for part in says for node in ast.walk(part)}
        wrong = (node for node in ast.walk(tree) if rounded_differently(node) and node not in stated)
        found += [f"{path.name}:{node.lineno}" for node in wrong if path.name not in SHOWN]
    for path in (ROOT / "nscd/core").glob("*.[ch]pp"):
        lines = enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        wrong = (number for number, line in lines if OF_LIBM.search(line))
        found += [f"{path.name}:{number}" for number in wrong if path.name not in SHOWN]
    assert not found


def made():
    """The digests of scenes of two seeds, other crowds, contact problems, their answers and short runs."""
    crowd = Crowd(people=40, friction=0.3, varied=Varied(people="ANSUR II", seed=3))
    scenes = {f"{name} {seed}": make(name, seed=seed) for name in MAKERS for seed in (1, 2)}
    scenes |= {f"gate {number}": variant(read_scene("gate"), number) for number in (1, 3)}
    scenes["room"] = room("a", 8.0, 6.0, 0.8, crowd)
    scenes["stream"] = room("b", 9.0, 3.0, opposing(9.0, 3.0), crowd)
    parts = {"page": json.dumps(content_of(read_scene("terrace"))).encode()}
    for name, family in FAMILIES.items():
        case = family(60, 3)
        disks, left = case.snapshot, case.left_velocity
        solution = solve(disks, case.contacts, left_velocity=left, law=ContactLaw(friction=0.3))
        arrays = disks.position, disks.mass, left, solution.impulse, solution.right_velocity
        parts[name] = b"".join(array.tobytes() for array in arrays)
    with tempfile.TemporaryDirectory() as folder:
        for name, scene in scenes.items():
            files = sorted(scene.write(Path(folder) / name).parent.iterdir())
            parts[name] = scene.digest().encode() + b"".join(file.read_bytes() for file in files)
        for name in ("gate", "shoulders", "terrace", "ell"):
            scene = read_scene(name).with_run(duration_s=0.2, frames=2)
            path = scene.write(Path(folder) / f"run {name}")
            assert rigid.main([str(path), "--out", str(path.parent)]) == 0
            parts[f"run {name}"] = (path.parent / "impulses.dump").read_bytes()
    return {name: hashlib.sha256(part).hexdigest() for name, part in parts.items()}


def test_makers_and_runs_give_the_same_bits_without_the_processors_own_kernels():
    libm = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"
    kernels = {"NPY_DISABLE_CPU_FEATURES": dispatched(), "OPENBLAS_CORETYPE": "Nehalem"}
    end = python(CODE, GLIBC_TUNABLES=libm, **kernels)
    assert end.returncode == 0, end.stderr
    assert json.loads(end.stdout.splitlines()[-1]) == made()
