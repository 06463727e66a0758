"""The house: imports go one way, functions are short, and the whole stays small."""

import ast
import graphlib
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("nscd", "analysis", "crowd_percussions")
# A docstring does not count among the lines of its function, nor `self` among the parameters.
FUNCTION_LINES, PARAMETERS = 60, 7
# A command has one parameter for each of its options.
COMMANDS = ROOT / "analysis" / "cli"
# Lines of the product, in Python and C++, and of the tests: less is the aim.
PRODUCT_LINES, TEST_LINES = 71_120, 29_760
PRODUCT = (*PACKAGES, "yade_scripts", "benchmarks", "examples")
# Words that names of functions, variables, classes and fields do not take again: each meant many things.
PRIVATE = set(
    re.findall(
        r"\w+",
        """acting answer answers apart asked astray bounded certified climb close_all close_set close_single contacts_given
        correct_guess descend_and_close disks_given drifts find_by_name firm_and_close firm_up freed gain_nothing gaining given
        heads held kept left_s left_v likeness likeness_of locally look looks momentum_given of_members off_by offer open_own
        openness openness_of price put rebounds reel reels rough rubbed rubbing rung said seen settle share shares smear
        system_of taken told touching unheld unlikeness whole wide ASKED_FOR Asked Closed Descended Followed FrictionAsked
        MARGINAL Openness OwnContacts Remainder SEVERAL SETS Stepped UNEVEN""",
    )
)
# Where such a word is the key of a file or an option of a command, which stay.
KEYS = {
    "analysis/studies/advice/choice.py: likeness", "analysis/studies/advice/library.py: likeness",
    "analysis/cli/compare.py: openness", "analysis/cli/runs.py: openness", "analysis/cli/scenes.py: apart",
    "analysis/scene/waiting.py: share", "analysis/percussions/audit/judge.py: given",
    "analysis/studies/infer/inference.py: seen", "analysis/studies/paper/continuum/fig7_border.py: apart",
    "analysis/percussions/listed_contacts.py: apart", "analysis/percussions/solve_dump.py: apart",
    "analysis/studies/stability/case.py: said", "analysis/studies/stability/case.py: whole",
}  # fmt: skip
# Imports go one way, from the ground up; folders of one rank know nothing of each other, and
# neither do two of one line.
RANKS = [
    ["nscd"],
    ["nscd/friction"],
    ["nscd/solve.py"],
    ["nscd/rivals.py", "nscd/stepping"],
    ["nscd/__init__.py"],
    ["nscd/indeterminacy"],
    ["nscd/continuum"],
    ["nscd/continuum/rivals"],
    ["analysis/__init__.py"],
    ["analysis/support"],
    ["analysis/support/lammps_process"],
    ["analysis/scene"],
    ["analysis/scene/real"],
    ["analysis/dumps"],
    ["analysis/percussions/audit"],
    ["analysis/engines"],
    ["analysis/percussions"],
    ["analysis/compare"],
    ["analysis/pages"],
    ["analysis/studies/__init__.py"],
    ["analysis/studies/exposure", "analysis/studies/exchange"],
    ["analysis/studies/motion"],
    ["analysis/studies/work_precision", "analysis/studies/stability", "analysis/studies/standards",
     "analysis/studies/paper", "analysis/studies/push", "analysis/studies/measured", "analysis/studies/infer"],
    ["analysis/studies/advice", "analysis/studies/film", "analysis/studies/explore"],
    ["analysis/studies/report", "analysis/studies/audit.py"],
    ["analysis/cli", "crowd_percussions"],
]  # fmt: skip


def sources(*folders, kinds=(".py",)):
    """The files of the folders, without what was built."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.*")):
            if path.suffix in kinds and "__pycache__" not in path.parts:
                yield path


def modules():
    """Name → path of every module of the packages, the core's included."""
    found = {}
    for path in sources(*PACKAGES, kinds=(".py", ".pyi")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(path, known):
    """The modules of the packages that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                if full in known:
                    yield full
                elif node.module in known:
                    yield node.module


def test_every_rank_is_of_something():
    assert [name for rank in RANKS for name in rank if not (ROOT / name).exists()] == []


def rank_of(path):
    """The rank of a file: of its own entry, or of the nearest folder above that has one."""
    name = path.relative_to(ROOT)
    for candidate in (name, *name.parents):
        for rank, indices in enumerate(RANKS):
            if str(candidate) in indices:
                return rank, str(candidate)
    raise AssertionError(f"{name}: its folder has no rank")


def test_imports_go_one_way_and_never_in_a_circle():
    known = modules()
    graph = {name: set(imported(path, known)) - {name} for name, path in known.items()}
    for name, path in known.items():
        rank, home = rank_of(path)
        for module in graph[name]:
            other, there = rank_of(known[module])
            assert other < rank or there == home, f"{path.relative_to(ROOT)} imports {module}"
    list(graphlib.TopologicalSorter(graph).static_order())


def lines_of(function):
    """Lines of a function, without its decorators and its docstring."""
    first, *_ = function.body
    documented = ast.get_docstring(function) is not None
    words = first.end_lineno - first.lineno + 1 if documented else 0
    return function.end_lineno - function.lineno + 1 - words


def parameters_of(function):
    inputs = function.args
    names = [arg.arg for arg in (*inputs.posonlyargs, *inputs.args, *inputs.kwonlyargs)]
    return len([name for name in names if name not in ("self", "cls")])


def test_functions_are_short_and_take_few_parameters():
    large = []
    for path in sources(*PACKAGES, "benchmarks", "yade_scripts"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                name = f"{path.relative_to(ROOT)}: {node.name}"
                if (count := lines_of(node)) > FUNCTION_LINES:
                    large.append(f"{name}: {count} lines")
                if (count := parameters_of(node)) > PARAMETERS and COMMANDS not in path.parents:
                    large.append(f"{name}: {count} parameters")
    assert not large


def texts_of(path):
    """The texts of a file, X for a value; without docstrings, but for those of commands."""
    inner = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Expr) and COMMANDS not in path.parents:
            inner.add(id(node.value))
        elif isinstance(node, ast.JoinedStr):
            inner.update(map(id, node.values))
            yield "".join(
                getattr(each, "value", "") if each.__class__ is ast.Constant else "X"
                for each in node.values
            )
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner
        ):
            yield node.value


def test_messages_are_short_sentences_without_semicolons():
    texts = [one for path in sources(*PACKAGES, "yade_scripts") for one in texts_of(path)]
    plain = [one for one in texts if " | " not in one]  # no table of columns
    assert [one for one in plain if re.search(r"\w\W?; ", one)] == []
    split = (re.split(r"(?<=[.?!])\s+|\n\n", one) for one in plain)
    assert [one for each in split for one in each if len(one.split()) > 25] == []


def test_the_whole_is_no_larger():
    def total(*folders):
        kinds = (".py", ".cpp", ".hpp", ".h", ".js")
        return sum(path.read_bytes().count(b"\n") for path in sources(*folders, kinds=kinds))

    assert total(*PRODUCT) <= PRODUCT_LINES
    assert total("tests") <= TEST_LINES


def names_in(path):
    """What a file names: in Python what it binds, in C++ every identifier."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        yield from re.findall(r"\w+", re.sub(r'"(?:\\.|[^"\\\n])*"|//[^\n]*', "", text))
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(getattr(node, "ctx", None), ast.Store):
            yield getattr(node, "id", getattr(node, "attr", ""))


def test_names_are_words_of_the_field():
    files = sources(*PRODUCT, "tests", kinds=(".py", ".cpp", ".hpp"))
    found = {f"{path.relative_to(ROOT)}: {name}" for path in files for name in names_in(path) if name.strip("_") in PRIVATE}
    assert found - KEYS == set()
