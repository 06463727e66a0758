"""The machine that something was measured on, in words."""

import functools
import os
import platform
import re
from pathlib import Path


def cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0))


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
