"""What README, docs and examples import is `crowd_percussions`, whatever folder one is in."""

import ast
import json
import re
import subprocess
import sys
import textwrap

import pytest

import crowd_percussions
from tests.docs.documented import ROOT, blocks

PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]
# What these show becomes a part of the product, and imports as that does.
PARTS = {"engine.md", "figure.md", "solver.md"}
OWN = ("analysis", "nscd")


def shown():
    """The Python of each page, example and notebook, by name."""
    for page in PAGES:
        for number, block in enumerate(blocks(page.relative_to(ROOT))):
            lines = re.findall(r"^(?:>>>|\.\.\.) ?(.*)", block.text, re.MULTILINE)
            if page.name not in PARTS and (lines or "import " in block.text):
                text = "\n".join(lines) if lines else block.text
                if block.language in ("python", "") and re.search(r"^(from|import) ", text, re.M):
                    yield f"{page.name}, block {number}", text
    for path in sorted((ROOT / "examples").glob("*.py")):
        yield path.name, path.read_text(encoding="utf-8")
    for path in sorted((ROOT / "examples").glob("*.ipynb")):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        code = ("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
        yield path.name, "\n".join(code)


def test_everything_shown_is_of_crowd_percussions():
    texts = dict(shown())
    assert len(texts) > 20
    names = set()
    for name, text in texts.items():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom):
                assert node.module.split(".")[0] not in OWN, name
                if node.module == "crowd_percussions":
                    names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.Import):
                assert not {alias.name.split(".")[0] for alias in node.names} & set(OWN), name
    assert len(names) > 30
    for name in names:
        assert getattr(crowd_percussions, name) is not None


@pytest.mark.long
@pytest.mark.parametrize(
    ("program", "status", "says"),
    [
        ("import crowd_percussions as c; c.solve, c.read_scene", 0, "analysis.*from now on"),
        ("import nscd; import crowd_percussions", 1, "ImportError.*nscd.*rename this one"),
        (None, 0, ""),
    ],
)
def test_folders_of_the_same_names(tmp_path, program, status, says):
    """Of the user, in the current folder."""
    for name in OWN:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("mine = True\n")
    if program is None:  # as the console script begins, whose own folder comes first
        script = tmp_path / "bin" / "percussions"
        script.parent.mkdir()
        script.write_text("from analysis.cli import main\nmain()\n")
        words = [str(script), "run", "pair", "--engine", "rigid", "--duration", "0.01"]
    else:
        script = tmp_path / "mine.py"
        script.write_text(textwrap.dedent(program))
        words = [str(script)]
    errors = tmp_path / "stderr.txt"  # in a file: a warning in a pipe fails a test
    with errors.open("w") as file:
        how = {"cwd": tmp_path, "stdout": file, "stderr": file}
        made = subprocess.run([sys.executable, *words], **how, check=False)
    output = errors.read_text()
    assert made.returncode == status, output
    assert re.search(says, output, re.DOTALL), output
