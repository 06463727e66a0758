"""A machine that gives little: memory, and no folder to write in."""

import resource
import subprocess
import sys


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
