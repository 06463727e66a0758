"""The machine that something was measured on, in words."""

import functools
import importlib.util
import os
import platform
import re
from pathlib import Path


@functools.cache
def machine() -> str:
    """Processor, cores and system in one line."""
    try:
        names = re.findall(
            r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text(encoding="utf-8")
        )
    except OSError:
        names = []
    processor = names[0].strip() if names else platform.processor() or platform.machine()
    return f"{processor}, {os.cpu_count()} cores, {platform.system()}"


def compiles_first() -> bool:
    """Tell whether no kernel of `nscd` has been compiled yet where Python keeps them."""
    found = importlib.util.find_spec("nscd")
    folder = Path(found.origin).parent if found and found.origin else None
    # elsewhere than beside the code they cannot be seen
    if folder is None or "NUMBA_CACHE_DIR" in os.environ or not os.access(folder, os.W_OK):
        return False
    return not any(folder.rglob("*.nbi"))
