"""The process of an engine: run a command in a folder, end it with whoever started it, and say what
it cost."""

import ctypes
import gc
import hashlib
import importlib
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
import traceback
import uuid
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from analysis.support import parallel

LAST_LINES = 12
# characters of a line, and of what is shown of it
LONGEST_LINE, LONGEST_SAID = 1 << 16, 400
SCREEN = "screen.log"
# Every process of a run has a variable of this name, and a value of its run's own: ranks of MPI are
# in sessions of their own, which no group holds together.
RUN_VARIABLE = "CROWD_PERCUSSIONS_RUN"
PR_SET_PDEATHSIG = 1  # of Linux
GUARDIAN = Path(__file__).with_name("guardian.sh")

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
    libraries of this environment (MPI's is one of them). The module has a `main(words)` that returns
    the exit status."""
    root, libraries = Path(__file__).resolve().parents[2], Path(sys.prefix) / "lib"
    paths = {"PYTHONPATH": root, "LD_LIBRARY_PATH": libraries}
    environment = {
        name: os.pathsep.join(filter(None, [str(path), os.environ.get(name, "")])) for name, path in paths.items()
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
    silent_s: float | None = None,
    on_line: Callable[[str], None] | None = None,
) -> Ended:
    """Run the command in the folder and return how it ended.

    longest_s, silent_s: it is killed after so many s, and after so many without its first line

    What it says goes to the file `screen` and, line by line, to `on_line`. All its processes end when
    it ends, and with this process, whatever ends that. The CPU time is that of the children of
    this process, so a process runs one command at a time."""
    last: deque[str] = deque(maxlen=LAST_LINES)
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    run, expired = uuid.uuid4().hex, threading.Event()
    with _guardian(run) as kill, (folder / screen).open("w", encoding="utf-8") as log:
        process = _started(command, folder, run)
        assert process.stdout is not None

        def expire() -> None:
            expired.set()
            kill()
            process.kill()  # a fork has the environment of its worker

        timers = {what: threading.Timer(seconds, expire)
                  for what, seconds in (("all", longest_s), ("first", silent_s)) if seconds}  # fmt: skip
        for timer in timers.values():
            timer.start()
        try:
            while line := process.stdout.readline(LONGEST_LINE):
                if "first" in timers:
                    timers["first"].cancel()
                log.write(line)
                if line.strip():
                    words = line.rstrip().expandtabs()
                    shown = "".join(c if c.isprintable() else "?" for c in words)
                    last.append(shown[:LONGEST_SAID])
                if on_line:
                    on_line(line)
            status = process.wait()
        finally:
            for timer in timers.values():
                timer.cancel()
            if process.poll() != 0:
                kill()
                process.kill()
                process.wait()
            process.stdout.close()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Ended(
        status=None if expired.is_set() else status,
        last=tuple(last),
        wall_seconds=time.perf_counter() - start,
        cpu_seconds=after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    )


def _started(command: Command, folder: Path, run: str) -> subprocess.Popen[str]:
    """A command that has begun, in a group of its own, since `lmp` of a Python environment starts the
    real one. The group ends with it: what an engine leaves behind would hold its output open. A worker
    runs a module of the product in a fork, since a new Python imports longer than most runs last."""
    become = None
    if parallel.is_worker and command.words[:2] == (sys.executable, "-m"):
        become = partial(_become, importlib.import_module(command.words[2]).main, command)
    process = subprocess.Popen(
        command.words,
        cwd=folder,
        env={**os.environ, **command.environment, RUN_VARIABLE: run},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
        preexec_fn=become,
    )

    def end_rest() -> None:
        process.wait()
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    threading.Thread(target=end_rest, daemon=True).start()
    return process


def _become(program: Callable[[Sequence[str]], int], command: Command) -> None:
    """Run the program of a command in this fork of a worker and end as it does; end with the worker, too."""
    status = 1
    try:
        gc.freeze()  # no file of the worker is closed by its old number
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        os.environ.update(command.environment)
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))  # that too on which the worker waits for its start
        sys.stdout = sys.stderr = os.fdopen(1, "w", encoding="utf-8", errors="replace")
        status = program(command.words[3:])
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        os._exit(status)


@contextmanager
def _guardian(run: str) -> Iterator[Callable[[], None]]:
    """Start what kills the processes of a run when this process dies, before there are any; give a
    call that has it kill them now."""
    guardian = subprocess.Popen(
        ["/bin/sh", str(GUARDIAN), f"{RUN_VARIABLE}={run}"],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    assert guardian.stdin is not None
    ended = guardian.stdin

    def kill() -> None:
        with suppress(OSError):
            ended.close()
        guardian.wait()

    try:
        yield kill
    except BaseException:
        kill()
        raise
    if not ended.closed:
        guardian.communicate(b"ended\n")


def version_of(command: str | Path | None, option: str, pattern: str) -> str | None:
    """Start the command with the option and return the first group of the pattern in what it says;
    None where it is missing, does not start or says something else."""
    match = re.search(pattern, output_of(command, option)) if command else None
    return match[1].strip() if match else None


def output_of(command: str | Path, option: str) -> str:
    """Start the command with the option and return what it says, or why it does not start."""
    try:
        ended = subprocess.run([command, option], capture_output=True, text=True, timeout=60, check=False)
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
