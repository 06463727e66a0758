"""The house: sizes that no function may outgrow, and docstrings for every name that others may use."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("nscd", "analysis", "crowd_percussions", "benchmarks", "yade_scripts")
# A docstring does not count among the lines of its function, nor `self` among the parameters.
FUNCTION_LINES, PARAMETERS = 60, 7
# A command has one parameter for each of its options.
COMMANDS = ROOT / "analysis" / "cli"
PUBLIC = (
    "nscd", "nscd.friction", "nscd.indeterminacy", "nscd.stepping", "analysis.scene",
    "analysis.dumps", "analysis.engines", "analysis.percussions", "analysis.compare",
)  # fmt: skip
# First words of what is no sentence with a verb in front.
NO_VERBS = {"A", "All", "An", "Any", "Each", "Every", "How", "It", "No", "Nothing", "One", "That", "The",
            "These", "This", "What", "When", "Where", "Whether", "Which", "Who"}  # fmt: skip


def modules(*folders):
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def functions(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]


def lines_of(function):
    """Lines of a function, without its decorators and its docstring."""
    first, *_ = function.body
    documented = ast.get_docstring(function) is not None
    words = first.end_lineno - first.lineno + 1 if documented else 0
    return function.end_lineno - function.lineno + 1 - words


def parameters_of(function):
    given = function.args
    names = [arg.arg for arg in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len([name for name in names if name not in ("self", "cls")])


def test_functions_are_short_and_take_few_parameters():
    large = []
    for path in modules(*PRODUCT):
        for function in functions(path):
            name = f"{path.relative_to(ROOT)}: {function.name}"
            if (count := lines_of(function)) > FUNCTION_LINES:
                large.append(f"{name}: {count} lines")
            if (count := parameters_of(function)) > PARAMETERS and COMMANDS not in path.parents:
                large.append(f"{name}: {count} parameters")
    assert not large


# What is done in one module only, by the words that do it there.
ONE_HOME = {
    r"ProcessPoolExecutor\(|\.Pool\(": "analysis/support/parallel.py",
    r"subprocess\.(Popen|run|call|check_\w+)\(|os\.system\(": "analysis/engines/process.py",
    r"os\.(replace|rename)\(|indent=1, ensure_ascii|csv\.\w*[wW]riter\(": "analysis/support/files.py",
    r"np\.(savez|load)\(|pickle\.|shelve\.|joblib": "analysis/support/cache.py",
    r"\.savefig\(": "analysis/pages/html.py",
    r'"#[0-9A-Fa-f]{6}"': "analysis/pages/drawing.py",
    r"maketrans\(": "analysis/pages/numbers.py",
    r"\bfree_speed: float = \d": "nscd/continuum/medium.py",
}
# For a reason of their own: nscd imports nothing from analysis; the rows of a dump stream; files of
# others are read in a process that lasts and imports nothing of the product.
EXCEPTED = {
    "nscd/show.py",
    "analysis/percussions/solving.py",
    "analysis/support/foreign.py",
    "analysis/support/foreign_child.py",
}


def test_what_several_rooms_need_is_written_once():
    sources = {
        str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
        for path in modules("nscd", "analysis")
    }
    for words, home in ONE_HOME.items():
        found = {name for name, text in sources.items() if re.search(words, text)}
        assert found - EXCEPTED == {home}, words


def test_the_measures_see_what_is_too_large(tmp_path):
    path = tmp_path / "large.py"
    body = '    """Two\n    lines."""\n' + "    x = 1\n" * 60
    path.write_text(f"def long(self, a, b, *, c):\n{body}")
    (function,) = functions(path)
    assert (lines_of(function), parameters_of(function)) == (61, 3)


def documented(kind, tree, prefix=""):
    """Name and docstring of what is public in a module or class."""
    for node in tree.body:
        if isinstance(node, kind) and not node.name.startswith("_"):
            yield prefix + node.name, ast.get_docstring(node)
            if isinstance(node, ast.ClassDef):
                yield from documented(kind, node, f"{node.name}.")


@pytest.mark.parametrize("package", ["nscd", "analysis"])
def test_every_public_name_has_a_docstring(package):
    bare = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in modules(package)
        for name, words in documented((ast.FunctionDef, ast.ClassDef), ast.parse(path.read_text()))
        if not words
    ]
    assert not bare


def exported(package):
    """Name and docstring of every class and function of a package's interface, methods included."""
    home = importlib.import_module(package)
    for name in home.__all__:
        thing = getattr(home, name)
        if not (inspect.isclass(thing) or inspect.isfunction(thing)):
            continue
        yield name, inspect.getdoc(thing)
        for inner, part in vars(thing).items() if inspect.isclass(thing) else ():
            method = getattr(part, "__func__", part)
            if inspect.isfunction(method) and not inner.startswith("_"):
                yield f"{name}.{inner}", inspect.getdoc(method)


@pytest.mark.parametrize("package", PUBLIC)
def test_docstrings_of_the_interface_begin_with_a_verb(package):
    found = dict(exported(package))
    assert found
    for name, words in found.items():
        first = words.split()[0]
        assert first.isalpha(), f"{name}: {first}"
        assert first.istitle(), f"{name}: {first}"
        assert first not in NO_VERBS, f"{name}: {first}"
        assert "." in words or ":" in words, name
