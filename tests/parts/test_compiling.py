"""Kernels called by their address, and kernels without an entry for Python."""

import importlib
import subprocess
import sys

import pytest

LOW = """
import numpy as np
from nscd.compiling import inner

@inner(apart=True)
def scaled(x, by):
    if by == 0.0:
        raise ZeroDivisionError("nothing")
    return by * x, len(x)

@inner(apart=True)
def counted(x):
    return RESULT
"""
TOP = """
import low
from nscd.compiling import kernel

@kernel
def twice(x, by):
    once, _ = low.scaled(x, by)
    return low.scaled(once, by)[0]

@kernel
def count(x):
    return low.counted(x) + 1
"""
ANOTHER_PROCESS = """
import numpy as np
import top
print(top.twice(np.ones(2), 3.0), sum(top.twice.stats.cache_hits.values()))
try:
    top.count(np.ones(2))
except RuntimeError as error:
    print(error)
"""


def test_a_kernel_called_by_its_address_is_found_by_another_process(tmp_path, monkeypatch):
    (tmp_path / "low.py").write_text(LOW.replace("RESULT", "len(x)"))
    (tmp_path / "top.py").write_text(TOP)
    monkeypatch.syspath_prepend(tmp_path)
    low, top = importlib.import_module("low"), importlib.import_module("top")
    numpy = importlib.import_module("numpy")
    assert top.twice(numpy.ones(2), 3.0).tolist() == [9.0, 9.0]
    assert top.count(numpy.ones(2)) == 3
    with pytest.raises(ZeroDivisionError, match="nothing"):
        top.twice(numpy.ones(2), 0.0)
    with pytest.raises(TypeError, match="scaled: for kernels only"):
        low.scaled(numpy.ones(2), 3.0)
    (inside,) = top.twice.overloads.values()
    assert not any("scaled" in f.name for f in inside.library.get_defined_functions())
    # of another kind than what the caller was compiled for
    (tmp_path / "low.py").write_text(LOW.replace("RESULT", "0.5 * len(x)"))
    said = subprocess.run(
        [sys.executable, "-c", ANOTHER_PROCESS], cwd=tmp_path, text=True, capture_output=True
    )
    first, second = said.stdout.splitlines()
    assert first == "[9. 9.] 1"
    assert second.startswith("a kernel that this one calls has changed: delete")
