"""A machine that gives little, and `make install` again after an interrupted one."""

import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# stands for the system's Python and for that of the environment; says what it was asked for
PYTHON = """#!/bin/sh
echo "$*" >>"{log}"
case "$*" in
    "-m venv"*) mkdir -p "{environment}/bin"; cp "$0" "{environment}/bin/python" ;;
    *--editable*) [ ! -e "{log}.interrupt" ] || exit 130 ;;
esac
"""


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_an_interrupted_installation_begins_with_an_empty_environment(tmp_path):
    """What pip has half written it takes for installed the next time."""
    log, environment = tmp_path / "log", tmp_path / "environment"
    fake = tmp_path / "python"
    fake.write_text(PYTHON.format(log=log, environment=environment))
    fake.chmod(0o755)

    def make():
        log.write_text("")
        words = ["-o", "system", f"PYTHON3={fake}", f"VENV={environment}"]
        status = subprocess.run(
            ["make", *words, f"{environment}/installed"], cwd=ROOT, capture_output=True
        ).returncode
        return status, f"-m venv --clear {environment}\n" in log.read_text()

    interrupt = Path(f"{log}.interrupt")
    interrupt.touch()
    status, _ = make()
    assert status != 0
    assert make() == (2, True)
    interrupt.unlink()
    assert make() == (0, True)
    # a newer list of packages is installed into the environment that is there
    (environment / "installed").unlink()
    assert make() == (0, False)


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
def test_lint_leaves_the_files_of_a_user_alone():
    """Somebody's plot.py beside the Makefile prints, as a script may."""
    requested = subprocess.run(["make", "-n", "lint"], cwd=ROOT, capture_output=True, text=True)
    ours = "nscd analysis crowd_percussions yade_scripts benchmarks examples tests docs"
    assert f"ruff check {ours}\n" in requested.stdout


def test_little_memory_is_said_at_once():
    """OpenBLAS tries without end to find room."""

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (400 << 20, 400 << 20))

    ended = subprocess.run(
        [sys.executable, "-c", "from analysis.cli import main; main()", "scenes"],
        preexec_fn=limited, capture_output=True, text=True, timeout=60, check=False,
    )
    assert ended.returncode == 1
    assert ended.stderr == (
        "percussions: memory is limited to 400 MB of address space (ulimit -v). At least 1024 MB "
        "are needed\n"
    )
