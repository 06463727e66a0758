"""One case: damage, run, judge. Exit 0 only with finite, complete, unambiguous numbers; otherwise
one line that names file, line or field, in bounded time, and nothing else changed on disk."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import random as randomness
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.cli import main
from analysis.engines import run as engine_runs
from analysis.engines.penalty import penalty_of
from analysis.engines.record import EngineError
from tests.fuzz import oracle
from tests.fuzz.material import OPTIONS, ROOT, Material
from tests.fuzz.mutations import damage, damage_words
from tests.fuzz.oracle import FaultError, need

# CPU time of a case, the compilation of kernels that it is the first to use included; of the clock
# it may take longer, where the machine is busy.
LONGEST_CPU_S, LONGEST_S = 90.0, 240.0
# Disks times steps of a run that is worth an engine's time here.
DEAR = 1e6
# Lines of a command that ends well.
BESIDE = re.compile(r"(warning|note): |.*: about \d|.* so far")
INTERNAL = 70


class TooLongError(BaseException):
    """A case beyond its time."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a case ended: exit status, what it said, seconds."""

    status: int
    said: str
    printed: str
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Case:
    """A damaged command."""

    material: Material
    words: tuple[str, ...]
    process: bool

    @classmethod
    def of(cls, workshop, seed, number):
        """The case of that number; one in 40 runs in a process of its own."""
        random = randomness.Random(f"{seed} {number}")
        material = workshop.make(random)
        words, files = material.words, dict(material.files)
        if random.random() < 0.2:
            if random.random() < 0.1:
                words = ("scenes", "--make", "pair")
                material = replace(material, kind="words", files={}, words=words)
                files = {}
            words = tuple(damage_words(random, words, OPTIONS[words[0]]))
        else:
            files[material.target] = damage(random, files[material.target])
        return cls(
            material=replace(material, files=files),
            words=words,
            process=number % 40 == 39 and words[0] != "run",
        )

    @property
    def as_typed(self):
        return shlex.join(("percussions", *self.words))


def judge(case, folder):
    """Run a case in an empty folder. Raises FaultError."""
    shutil.rmtree(folder, ignore_errors=True)
    here, spare = folder / "here", folder / "spare"
    spare.mkdir(parents=True)
    here.mkdir()
    for name, content in case.material.files.items():
        (here / name).parent.mkdir(exist_ok=True)
        (here / name).write_bytes(content)
    before = _tree(here)
    outcome = (_process if case.process else _call)(case.words, here, spare)
    after = _tree(here)
    need(outcome.seconds < LONGEST_CPU_S, f"took {outcome.seconds:.0f} s")
    need(not list(spare.iterdir()), f"left {[p.name for p in spare.iterdir()]} behind")
    for text in (outcome.said, outcome.printed):
        need("Traceback" not in text, f"a traceback: {text[-600:]}")
    lost = {name for name in before if after.get(name) != before[name]}
    new = {name for name in after if name not in before}
    if outcome.status == 0:
        need(not lost, f"changed {sorted(lost)}")
        _judge_success(case, outcome, here, new)
    else:
        _judge_refusal(case, outcome, lost, new)
    return outcome


def _judge_refusal(case, outcome, lost, new):
    lines = outcome.said.strip().splitlines()
    need(outcome.status not in (INTERNAL, 130), f"a mistake in the program: {outcome.said[-300:]}")
    unsolved = [line for line in lines if re.search(r": (failed|inaccurate): ", line)]
    if unsolved and case.words[0] == "solve":
        need(len(unsolved) == len(lines), f"other lines: {outcome.said[:300]}")
        return
    # a run that its guard stopped stays, to be looked at
    stopped = {Path(name).parent for name in new if name.endswith("/run.json")}
    if "stopped by its guard" in outcome.said:
        new = {name for name in new if not stopped & set(Path(name).parents)}
    need(not lost | new, f"changed {sorted(lost | new)[:5]} and failed: {outcome.said[:200]}")
    lines = [line for line in lines if not BESIDE.match(line)]
    need(len(lines) == 1, f"{len(lines)} lines: {outcome.said[:600]!r}")
    (line,) = lines
    need(line.startswith("percussions: "), f"not a line of the program: {line}")
    need(len(line) < 700, f"a line of {len(line)} characters: {line[:300]}")
    # of what was given: files, words, or the keys of a file
    given = {Path(name).name for name in case.material.files} | {
        w for w in case.words if len(w) > 1
    }
    names = any(word in line for word in given) or re.search(
        r": [\w.]+: |--\w+|\w+:|Missing argument|extra argument|not a regular file|No such command '",
        line[13:],
    )
    need(names, f"names neither file nor field: {line}")


def _judge_success(case, outcome, here, new):
    for line in outcome.said.strip().splitlines():
        need(BESIDE.match(line), f"a line beside success: {line[:300]}")
    need(not re.search(r"\b(nan|inf)\b", outcome.printed), f"printed {outcome.printed[:400]}")
    words, material = case.words, case.material
    if "--help" in words or "--version" in words:
        return
    option = _options(words)
    if words[0] == "solve" and material.kind == "solve":
        out = Path(option.get("--out", "contacts.csv"))
        if out.is_absolute():
            return
        need(new == {str(out)}, f"wrote {sorted(new)}")
        dump = next((w for w in words[1:] if Path(w).name.startswith("some.dump")), "some.dump")
        left = option.get("--left-velocity", "dump" if "--room" not in option else "desired")
        oracle.check_solution(
            material.files[dump],
            (here / out).read_bytes(),
            float(option.get("--tolerance", 1e-8)),
            _reach(material, option),
            left == "dump" and "--room" not in option and "--restitution" not in option,
        )
    elif words[0] == "run" and material.kind == "run":
        for record in here.rglob("run.json"):
            files = {p.name: p.read_bytes() for p in record.parent.iterdir() if p.is_file()}
            oracle.check_run(files, material.files["scene.data"])
    elif words[0] == "compare" and material.kind == "compare":
        need(new == {"run/comparison.csv", "run/comparison.json"}, f"wrote {sorted(new)}")
        oracle.check_json((here / "run/comparison.json").read_bytes())
        rows = oracle.table_of((here / "run/comparison.csv").read_bytes())
        if len(words) == 2:
            reference = oracle.table_of(material.reference["comparison.csv"])
            need(rows == reference, "another comparison of a damaged folder")
    elif words[0] == "import" and material.kind == "import":
        _judge_import(case, option, here, new)
    elif words[0] == "scenes" and "--make" in words:
        need(len(new) == 2 or Path(option.get("--out", ".")).is_absolute(), f"wrote {sorted(new)}")


def _judge_import(case, option, here, new):
    report = next((name for name in new if name.endswith(".reconciliation.json")), None)
    if report is None:
        return
    content = oracle.check_json((here / report).read_bytes())
    name = next((word for word in case.words[1:] if word in case.material.files), None)
    if name is None or len(option) < 2:
        return
    people = oracle.people_in(case.material.files[name], name, option["--frame"])
    if people is not None:
        found = content["people"] + content["left_out"]
        need(people == found, f"{found} people where the file has {people}")


def _reach(material, option):
    if "--contact-tolerance" in option:
        return float(option["--contact-tolerance"])
    room = material.files.get("room.toml", b"") if "--room" in option else b""
    found = re.search(rb"contact_tolerance_m *= *(\S+)", room)
    return float(found[1]) if found else 1e-6


def _options(words):
    """Option → value; the last one counts."""
    found = {}
    for place, word in enumerate(words):
        if word.startswith("--"):
            name, equal, value = word.partition("=")
            found[name] = value if equal else words[place + 1] if place + 1 < len(words) else ""
    return found


def _tree(folder):
    """Path → what is there."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    } | {
        str(path.relative_to(folder)): "link"
        for path in folder.rglob("*")
        if path.is_symlink() or not (path.is_file() or path.is_dir())
    }


def _process(words, here, spare):
    ended = subprocess.run(
        [sys.executable, "-c", "from analysis.cli import main; main()", *words],
        cwd=here,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(spare)},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    seconds = 0.0  # what the clock says is bounded above
    return Outcome(
        status=ended.returncode, said=ended.stderr, printed=ended.stdout, seconds=seconds
    )


def _call(words, here, spare):
    said, printed = io.StringIO(), io.StringIO()
    before, argv, home = Path.cwd(), sys.argv, tempfile.tempdir
    began, status = time.process_time(), 0
    old = signal.signal(signal.SIGALRM, _too_long)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_S)
    try:
        os.chdir(here)
        sys.argv, tempfile.tempdir = ["percussions", *words], str(spare)
        with (
            contextlib.redirect_stderr(said),
            contextlib.redirect_stdout(printed),
            warnings.catch_warnings(),
            _cheap_engines(),
        ):
            warnings.simplefilter("always")
            main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
        os.chdir(before)
        sys.argv, tempfile.tempdir = argv, home
    return Outcome(
        status=status,
        said=said.getvalue(),
        printed=printed.getvalue(),
        seconds=time.process_time() - began,
    )


def _too_long(*_):
    raise TooLongError


@contextlib.contextmanager
def _cheap_engines():
    """Runs that would last are refused: they are not what is tested here."""
    real = engine_runs.run_engine

    def cheap(scene, name, folder, progress=None):
        if penalty_of(scene).steps * len(scene.snapshot) > DEAR:
            raise EngineError(f"{folder}: too dear for this test")
        return real(scene, name, folder, progress)

    engine_runs.run_engine = cheap
    try:
        yield
    finally:
        engine_runs.run_engine = real


def sweep(workshop, seed, numbers, folder, limit_s=float("inf"), told=None):
    """Judge many cases; returns how often each end came, and the faults: (number, case, words)."""
    ends, faults, began = Counter(), [], time.monotonic()
    for number in numbers:
        if time.monotonic() - began > limit_s:
            break
        case = Case.of(workshop, seed, number)
        try:
            outcome = judge(case, folder)
            ends[
                f"{case.words[0] if case.words else ''} {'accepted' if outcome.status == 0 else 'refused'}"
            ] += 1
        except (FaultError, subprocess.TimeoutExpired) as fault:
            faults.append((number, case, str(fault)))
            if told:
                told(number, case, str(fault))
    return ends, faults
