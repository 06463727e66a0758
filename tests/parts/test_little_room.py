"""A machine that gives little: memory, and no folder to write in."""

import resource
import subprocess
import sys

import pytest
from numba.core.caching import FunctionCache

from analysis.cli import _status_of
from nscd.compiling import kernel


def test_little_memory_is_said_at_once():
    """OpenBLAS tries without end to find room."""

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (400 << 20, 400 << 20))

    ended = subprocess.run(
        [sys.executable, "-c", "from analysis.cli import main; main()", "scenes"],
        preexec_fn=limited,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ended.returncode == 1
    assert ended.stderr == (
        "percussions: memory is limited to 400 MB of address space (ulimit -v); at least 1024 MB "
        "are needed\n"
    )


def test_no_folder_for_compiled_kernels_is_one_line(monkeypatch, capsys):
    """Neither the home folder nor the installation can be written."""

    def nowhere(self, function):
        raise RuntimeError(f"cannot cache function {function.__name__!r}: no locator available")

    monkeypatch.setattr(FunctionCache, "__init__", nowhere)
    # what the product imports to say so has kernels of its own
    monkeypatch.setitem(sys.modules, "analysis.engines.record", None)
    with pytest.raises(OSError, match="no folder") as refused:
        kernel(lambda x: x)
    assert _status_of(refused.value) == 1
    said = capsys.readouterr().err
    assert "nscd: no folder for compiled kernels: " in said
    assert "set NUMBA_CACHE_DIR" in said
    assert len(said.splitlines()) == 1
