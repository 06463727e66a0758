"""The core compiled to WebAssembly: from which sources, and how."""

import hashlib
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
WASM, DIGEST = HERE / "core.wasm", HERE / "core.sha256"
# Bindings to Python, and what no rigid step needs.
LEFT_OUT = {"c_interface", "module", "friction_module", "tools_module", "packing", "coarse_grain", "dump_text"}
FLAGS = (
    "-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c++20", "-O2", "-msimd128",
    "-ffp-contract=off", "-fno-exceptions", "-fno-rtti", "-fno-math-errno", "-Wl,--gc-sections",
    "-Wl,--strip-all",
)  # fmt: skip


def sources() -> list[Path]:
    """List what is compiled."""
    core = sorted((ROOT / "nscd" / "core").glob("*.cpp"))
    return [*(one for one in core if one.stem not in LEFT_OUT), HERE / "live.cpp"]


def digest() -> str:
    """Compute the SHA-256 of the sources, their headers and the flags."""
    hasher = hashlib.sha256(" ".join(FLAGS).encode())
    headers = {*(ROOT / "nscd" / "core").glob("*.hpp")} - {ROOT / "nscd" / "core" / "binding.hpp"}
    for path in [*sources(), *sorted(headers)]:
        hasher.update(path.read_bytes())
    return hasher.hexdigest()


def is_current() -> bool:
    """Whether the compiled core is of today's sources."""
    return DIGEST.read_text(encoding="utf-8").strip() == digest()


def compile_core() -> None:
    """Compile the core with the compiler of the Python package ziglang."""
    command = [sys.executable, "-m", "ziglang", "c++", *FLAGS, f"-I{ROOT / 'nscd' / 'core'}"]
    subprocess.run([*command, "-o", str(WASM), *map(str, sources())], check=True)
    WASM.chmod(0o644)
    DIGEST.write_text(digest() + "\n", encoding="utf-8")


if __name__ == "__main__":
    if "--current" in sys.argv:
        sys.exit(not is_current())
    compile_core()
