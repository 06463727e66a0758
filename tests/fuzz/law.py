"""One case: damage, run, judge. Exit 0 only with finite, complete, unambiguous numbers; otherwise
one line that names file, line or field, in bounded time, and nothing else changed on disk."""

from __future__ import annotations

import hashlib
import random as randomness
import re
import shlex
import shutil
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from tests.fuzz import oracle
from tests.fuzz.material import OPTIONS, Material
from tests.fuzz.mutations import damage, damage_words
from tests.fuzz.oracle import need
from tests.fuzz.running import LONGEST_CPU_S, Outcome, TooLongError, call, forked, started

# Lines of a command that ends well.
BESIDE = re.compile(r"(warning|note): |.*: about \d|.* so far")
INTERNAL = 70


@dataclass(frozen=True, kw_only=True)
class Case:
    """A damaged command."""

    material: Material
    words: tuple[str, ...]
    run: Callable[..., Outcome]

    @classmethod
    def of(cls, workshop, seed, number):
        """The case of that number; one in 40 runs in a process of its own, one in 400 in a Python of
        its own."""
        random = randomness.Random(f"{seed} {number}")
        material = workshop.make(random)
        words, files = material.words, dict(material.files)
        if material.kind == "known":  # damaged already, or told otherwise
            return cls(material=material, words=words, run=_runner(number, words))
        if random.random() < 0.2 or not material.target:
            if material.target and random.random() < 0.1:
                words = ("scenes", "--make", "pair")
                material = replace(material, kind="words", files={}, words=words)
                files = {}
            words = tuple(damage_words(random, words, OPTIONS[words[0]]))
        else:
            files[material.target] = damage(random, files[material.target], material.target)
        material = replace(material, files=files)
        return cls(material=material, words=words, run=_runner(number, words))

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
    outcome = case.run(case.words, here, spare)
    after = _tree(here)
    need(outcome.seconds < LONGEST_CPU_S, f"took {outcome.seconds:.0f} s")
    need(not list(spare.iterdir()), f"left {[p.name for p in spare.iterdir()]} behind")
    for text in (outcome.message, outcome.printed):
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
    lines = outcome.message.strip().splitlines()
    right = case.material.right
    need(
        right is None or isinstance(right[0], dict), f"refused what is right: {outcome.message[-300:]}"
    )
    need(outcome.status not in (INTERNAL, 130), f"a mistake in the program: {outcome.message[-300:]}")
    unsolved = [line for line in lines if re.search(r": (failed|inaccurate): ", line)]
    if unsolved and case.words[0] == "solve":
        need(len(unsolved) == len(lines), f"other lines: {outcome.message[:300]}")
        return
    # runs that are compared at an instant and cannot be by windows: both are said
    if any("not compared by windows" in line for line in lines) and case.words[0] == "compare":
        need(not lost, f"changed {sorted(lost)}")
        need(all(BESIDE.match(line) for line in lines), f"other lines: {outcome.message[:300]}")
        return
    failed = [line for line in lines if re.search(r", frame \d+: (failed|inaccurate): ", line)]
    if failed and case.words[0] == "film":
        pages = [name for name in new if name.endswith("film.html")]
        need(pages, "no page of a film with failed frames")
        return
    # a run that its guard stopped stays, to be looked at
    stopped = {Path(name).parent for name in new if name.endswith("/run.json")}
    if "stopped by its guard" in outcome.message:
        new = {name for name in new if not stopped & set(Path(name).parents)}
    need(not lost | new, f"changed {sorted(lost | new)[:5]} and failed: {outcome.message[:200]}")
    lines = [line for line in lines if not BESIDE.match(line)]
    need(len(lines) == 1, f"{len(lines)} lines: {outcome.message[:600]!r}")
    (line,) = lines
    need(line.startswith("percussions: "), f"not a line of the program: {line}")
    need(len(line) < 700, f"a line of {len(line)} characters: {line[:300]}")
    # of what was given: files, words, or the keys of a file
    arguments = {Path(name).name for name in case.material.files}
    arguments |= {word for word in case.words if len(word) > 1}
    names = any(word in line for word in arguments) or re.search(
        r": [\w.]+: |--\w+|\w+:|Missing argument|extra argument|not a regular file|No such command '",
        line[13:],
    )
    need(names, f"names neither file nor field: {line}")


def _judge_success(case, outcome, here, new):
    for line in outcome.message.strip().splitlines():
        need(BESIDE.match(line), f"a line beside success: {line[:300]}")
    words, material = case.words, case.material
    # a line may name a file that was asked for
    printed = outcome.printed
    for word in {word for word in words if re.search(r"nan|inf", word)}:
        printed = printed.replace(word, "")
    need(not re.search(r"\b(nan|inf)\b", printed), f"printed {printed[:400]}")
    if "--help" in words or "--version" in words:
        return
    if material.kind == "known":
        if material.right and isinstance(material.right[0], dict):
            oracle.check_same(here, words, material.right)
        else:
            oracle.check_known(here, material.right, outcome.message)
        return
    option = _options(words)
    where = Path(option.get("--out", ""))
    if where.is_absolute() or ".." in where.parts:  # it was asked for, and lies elsewhere
        return
    if words[0] == "solve" and material.kind == "solve":
        out = Path(option.get("--out", "contacts.csv"))
        need(new == {str(out)}, f"wrote {sorted(new)}")
        dump = next((w for w in words[1:] if Path(w).name.startswith("some.dump")), "some.dump")
        left = option.get("--left-velocity", "dump" if "--room" not in option else "desired")
        oracle.check_solution(
            material.files[dump],
            (here / out).read_bytes(),
            float(option.get("--tolerance", 1e-8)),
            _reach(material, option),
            _rounding(outcome.message),
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
    elif material.kind in ("new", "export", "problem", "film", "push"):
        _judge_made(case, option, here, new)
    elif words[0] == "scenes" and "--make" in words:
        need(len(new) == 2, f"wrote {sorted(new)}")


def _judge_made(case, option, here, new):
    """New scenes, problems, tables, films and pushed rows."""
    kind, words = case.material.kind, case.words
    need(new or "/dev/null" in words, "nothing was written")
    for name in new:
        content = (here / name).read_bytes()
        if name.endswith(".csv"):
            oracle.check_words(content)
        elif name.endswith(".json"):
            oracle.check_json(content)
        elif name.endswith(".html"):
            need(content.rstrip().endswith(b"</html>"), f"{name}: half a page")
    if kind == "new":
        for name in (name for name in new if name.endswith(".data")):
            oracle.check_packed((here / name).read_bytes(), int(option.get("--people", 0)))
    elif kind == "export":
        for name in (name for name in new if name == "out.hdf5"):
            oracle.check_problem((here / name).read_bytes(), float(option.get("--tolerance", 1e-8)))
    elif kind == "problem" and new == {"table.csv"}:
        tolerance = float(option.get("--tolerance", 1e-8))
        table = (here / "table.csv").read_bytes()
        oracle.check_answer(case.material.files["some.hdf5"], table, tolerance)
    elif kind in ("film", "push"):
        need(any(name.endswith(".html") for name in new), f"no page: {sorted(new)}")


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


def _rounding(message):
    """What gaps may be wrong by where text has few digits: such a gap may be a contact."""
    found = re.search(r"gaps may be wrong by (\S+) m\. Such gaps are contacts", message)
    return 1.06 * float(found[1]) if found else 0.0


def _options(words):
    """Option → value; the last one counts."""
    found = {}
    for index, word in enumerate(words):
        if word.startswith("--"):
            name, equal, value = word.partition("=")
            found[name] = value if equal else words[index + 1] if index + 1 < len(words) else ""
    return found


def _runner(number, words):
    if number % 40 != 39 or words[0] == "run":
        return call
    return started if number % 400 == 399 else forked


def _tree(folder):
    """Path → what is there."""
    found = {}
    for path in folder.rglob("*"):
        name = str(path.relative_to(folder))
        if path.is_symlink() or not (path.is_file() or path.is_dir()):
            found[name] = "link"
        elif path.is_file():
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def sweep(workshop, seed, numbers, folder, limit_s=float("inf"), cells=None):
    """Judge many cases; returns how often each end came, and the faults: (number, case, words)."""
    ends, faults, began = Counter(), [], time.monotonic()
    for number in numbers:
        if time.monotonic() - began > limit_s:
            break
        case = Case.of(workshop, seed, number)
        try:
            outcome = judge(case, folder)
            ends[f"{case.material.kind} {'accepted' if outcome.status == 0 else 'refused'}"] += 1
        except (Exception, TooLongError) as fault:  # whatever is raised, the others go on
            faults.append((number, case, str(fault)))
            if cells:
                cells(number, case, str(fault))
    return ends, faults
