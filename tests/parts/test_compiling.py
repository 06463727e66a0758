"""Kernels called by their address, kernels without an entry for Python, kernels from the disk."""

import importlib
import pickle
import subprocess
import sys

import pytest
from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.types import float64

from nscd.compiling.by_address import _address
from nscd.compiling.sources import digest_of

LOW = """
import numpy as np
from nscd.compiling import inner

@inner(apart=True)
def scaled(x, by):
    if by == 0.0:
        raise ZeroDivisionError("nothing")
    return by * x, len(x)

@inner(apart=True)
def counted(x):
    return RESULT

@inner
def summed(x):
    return x.sum()
"""
TOP = """
import low
from nscd.compiling import kernel

@kernel
def twice(x, by):
    once, _ = low.scaled(x, by)
    return low.scaled(once, by)[0]

@kernel
def count(x):
    return low.counted(x) + 1

@kernel
def total(x):
    return low.summed(x)

@kernel
def fourfold(x):
    return 4 * total(x) + low.summed(x)
"""
LOADED = """
import sys
import numpy as np
import top
print(top.total(np.ones(3)), sum(top.total.stats.cache_hits.values()))
print("scipy.linalg" in sys.modules, "cffi" in sys.modules)
print(top.fourfold(np.ones(3)), sum(top.fourfold.stats.cache_misses.values()))
"""


def test_another_process_loads_kernels_and_finds_those_called_by_their_address(
    tmp_path, monkeypatch
):
    (tmp_path / "low.py").write_text(LOW.replace("RESULT", "len(x)"))
    (tmp_path / "top.py").write_text(TOP)
    monkeypatch.syspath_prepend(tmp_path)
    low, top = importlib.import_module("low"), importlib.import_module("top")
    numpy = importlib.import_module("numpy")
    assert top.twice(numpy.ones(2), 3.0).tolist() == [9.0, 9.0]
    assert top.count(numpy.ones(2)) == 3
    with pytest.raises(ZeroDivisionError, match="nothing"):
        top.twice(numpy.ones(2), 0.0)
    with pytest.raises(TypeError, match="scaled: for kernels only"):
        low.scaled(numpy.ones(2), 3.0)
    (inside,) = top.twice.overloads.values()
    assert not any("scaled" in f.name for f in inside.library.get_defined_functions())
    (called,) = low.scaled.overloads.values()
    assert called.library.ready
    # numba imports both when it readies itself to compile, here for `fourfold`
    assert top.total(numpy.ones(3)) == 3.0
    (taken_in,) = low.summed.overloads.values()
    assert not taken_in.library.ready
    # the same for others, and nothing of it is left to them
    total, made = top.total, cpu_target.target_context.codegen()
    assert njit(lambda x: total(x) + numpy.zeros_like(x).sum())(numpy.ones(3)) == 3.0
    assert made.create_library("of others").__class__ is JITCodeLibrary
    assert in_a_process(LOADED, tmp_path) == ["3.0 1", "False False", "15.0 1"]
    # of another kind than what a caller was compiled for
    arguments, found = next(iter(low.counted.overloads.items()))
    asked = [
        pickle.dumps(("low", "counted", arguments, kind))
        for kind in (found.signature.return_type, float64)
    ]
    assert [bool(_address(text, len(text))) for text in asked] == [True, False]


def test_a_change_in_what_a_kernel_calls_compiles_it_anew(tmp_path):
    """The code of `summed` is within `total`, in a file of its own that has not changed."""
    (tmp_path / "low.py").write_text(LOW.replace("RESULT", "1"))
    (tmp_path / "top.py").write_text(TOP)
    code = (
        "import numpy, top; print(top.total(numpy.ones(3)), *top.total.stats.cache_hits.values())"
    )
    assert in_a_process(code, tmp_path) == ["3.0"]
    assert in_a_process(code, tmp_path) == ["3.0 1"]
    (tmp_path / "low.py").write_text(LOW.replace("RESULT", "1").replace("x.sum()", "2 * x.sum()"))
    assert in_a_process(code, tmp_path) == ["6.0"]


def test_a_kernel_is_of_what_its_file_imports_directly_or_not_but_of_no_other_package(tmp_path):
    def digest(name, **changed):
        texts = {
            "ours/__init__": "",
            "ours/kernels": "from ours.middle import X\nfrom foreign.deep import Y",
            "ours/middle": "def late():\n    from ours.sub import value",
            "ours/sub/__init__": "",
            "ours/sub/value": "A = 1",
            "ours/beside": "",
            "foreign/__init__": "",
            "foreign/deep": "",
        }
        for path, text in (texts | {key.replace("__", "/"): "B = 2" for key in changed}).items():
            file = tmp_path / name / f"{path}.py"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return digest_of(str(tmp_path / name / "ours/kernels.py"))

    first = digest("first")
    assert digest("same") == first
    assert digest("elsewhere", foreign__deep=1, ours__beside=1) == first
    assert len({first, digest("far", ours__sub__value=1), digest("near", ours__middle=1)}) == 3


def test_of_processes_that_want_the_same_kernel_one_compiles_it(tmp_path):
    """Seen without turns: both do."""
    (tmp_path / "low.py").write_text(LOW.replace("RESULT", "1"))
    (tmp_path / "top.py").write_text(TOP)
    code = "import numpy, top; top.total(numpy.ones(3)); print(len(top.total.stats.cache_misses))"
    words = [sys.executable, "-c", code]
    both = [
        subprocess.Popen(words, cwd=tmp_path, text=True, stdout=subprocess.PIPE) for _ in range(2)
    ]
    assert sorted(process.communicate()[0] for process in both) == ["0\n", "1\n"]
    assert not list(tmp_path.rglob("*.lock"))


def in_a_process(code, folder):
    said = subprocess.run([sys.executable, "-c", code], cwd=folder, text=True, capture_output=True)
    assert not said.stderr
    return said.stdout.splitlines()
