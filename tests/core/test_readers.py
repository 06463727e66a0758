"""The core's readers under the sanitizers: dumps and random bytes (`make sanitize` has the rest)."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_readers_of_dumps_and_random_bytes_have_no_errors_of_memory(tmp_path):
    if shutil.which("g++") is None:
        pytest.skip("g++ is not installed: nothing to watch memory with")
    program = tmp_path / "readers"
    sources = [ROOT / "tests/core/readers.cpp", ROOT / "nscd/core/text.cpp"]
    flags = "-std=c++20 -O1 -g0 -Wno-psabi -fsanitize=address,undefined -fno-sanitize-recover=all"
    words = ["g++", *flags.split(), "-D_GLIBCXX_ASSERTIONS", f"-I{ROOT / 'nscd/core'}"]
    subprocess.run([*words, *sources, "-o", program], check=True, capture_output=True)
    ended = subprocess.run([program], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
