"""The process of an engine: run a command in a folder, end it with whoever started it, and say what
it cost."""

import hashlib
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

LAST_LINES = 12
# characters of a line, and of what is shown of it
LONGEST_LINE, LONGEST_SAID = 1 << 16, 400
SCREEN = "screen.log"
# Waits for a line. Where it comes to the end of the file instead, whoever should have written it is
# gone, and the process group given to it is killed.
_GUARDIAN = 'read -r line || kill -9 -- "-$1"'

# Signals that say why a process was killed.
_KILLED: dict[int, str] = {
    signal.SIGXFSZ: "a file became larger than is allowed (ulimit -f)",
    signal.SIGXCPU: "it used more CPU time than is allowed (ulimit -t)",
    signal.SIGKILL: "it was killed, perhaps since memory ran out",
    signal.SIGTERM: "it was told to end",
    signal.SIGSEGV: "it crashed",
    signal.SIGABRT: "it crashed",
    signal.SIGBUS: "it crashed",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """What starts an engine.

    words: the program and its arguments; environment: variables set besides those that are there.
    """

    words: tuple[str, ...]
    environment: Mapping[str, str]


def python_command(module: str, *words: str) -> Command:
    """Return the command that runs a module of the product in this Python, on one thread, with the
    libraries of this environment (MPI's is one of them)."""
    root, libraries = Path(__file__).resolve().parents[2], Path(sys.prefix) / "lib"
    paths = {"PYTHONPATH": root, "LD_LIBRARY_PATH": libraries}
    environment = {
        name: os.pathsep.join(filter(None, [str(path), os.environ.get(name, "")]))
        for name, path in paths.items()
    }
    one = {"OMP_NUM_THREADS": "1"}
    return Command(words=(sys.executable, "-m", module, *words), environment=environment | one)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How a command ended."""

    status: int | None  # negative for a signal, None where it was killed after its longest time
    last: tuple[str, ...]  # its last lines that are not empty
    wall_seconds: float
    cpu_seconds: float


def run_command(
    command: Command,
    folder: Path,
    *,
    screen: str = SCREEN,
    longest_s: float | None = None,
    on_line: Callable[[str], None] | None = None,
) -> Ended:
    """Run the command in the folder and return how it ended.

    What it says goes to the file `screen` and, line by line, to `on_line`. All its processes end when
    it ends, and with this process, whatever ends that. The CPU time is that of the children of
    this process, so a process runs one command at a time."""
    last: deque[str] = deque(maxlen=LAST_LINES)
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    # a group of its own, since `lmp` of a Python environment starts the real one
    process = subprocess.Popen(
        command.words,
        cwd=folder,
        env={**os.environ, **command.environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    assert process.stdout is not None
    expired = threading.Event()

    def expire() -> None:
        expired.set()
        _end_group(process)

    def end_rest() -> None:
        process.wait()
        # what an engine leaves behind would hold its output open
        _end_group(process)

    timer = threading.Timer(longest_s or 0.0, expire)
    threading.Thread(target=end_rest, daemon=True).start()
    try:
        with _guarded(process), (folder / screen).open("w", encoding="utf-8") as log:
            if longest_s is not None:
                timer.start()
            while line := process.stdout.readline(LONGEST_LINE):
                log.write(line)
                if line.strip():
                    words = line.rstrip().expandtabs()
                    shown = "".join(c if c.isprintable() else "?" for c in words)
                    last.append(shown[:LONGEST_SAID])
                if on_line:
                    on_line(line)
            status = process.wait()
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
    finally:
        timer.cancel()
        process.stdout.close()
    return Ended(
        status=None if expired.is_set() else status,
        last=tuple(last),
        wall_seconds=time.perf_counter() - start,
        cpu_seconds=after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    )


def _end_group(process: subprocess.Popen[str]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


@contextmanager
def _guarded(process: subprocess.Popen[str]) -> Iterator[None]:
    """Kill the group of the process when the block ends before it, or when this process dies."""
    guardian = subprocess.Popen(
        ["/bin/sh", "-c", _GUARDIAN, "guardian", str(process.pid)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield
    finally:
        if process.poll() is None:
            _end_group(process)
            process.wait()
        guardian.communicate(b"ended\n")


def version_said(command: str | Path | None, option: str, pattern: str) -> str | None:
    """Start the command with the option and return the first group of the pattern in what it says;
    None where it is missing, does not start or says something else."""
    match = re.search(pattern, said(command, option)) if command else None
    return match[1].strip() if match else None


def said(command: str | Path, option: str) -> str:
    """Start the command with the option and return what it says, or why it does not start."""
    try:
        ended = subprocess.run(
            [command, option], capture_output=True, text=True, timeout=60, check=False
        )
    except subprocess.TimeoutExpired:
        return "no answer within 60 s"
    except OSError as error:
        return str(error.strerror)
    return ended.stdout + ended.stderr + killed_by(ended.returncode)


def killed_by(status: int | None) -> str:
    """Say what killed a process of this exit status; nothing where it ended by itself.

    A signal n is the status −n of a process, 128 + n of a shell and 256 − n of LAMMPS' start; None
    stands for one that was killed by us."""
    if status is None:
        return _KILLED[signal.SIGKILL]
    if status < 0:
        return _KILLED.get(-status, "")
    return _KILLED.get(256 - status if status > 192 else status - 128, "")


def digest_of(files: Iterable[Path]) -> str:
    """SHA-256 of the names and contents of files."""
    content = hashlib.sha256()
    for path in sorted(files):
        content.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return content.hexdigest()
