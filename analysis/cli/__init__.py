"""The `percussions` command: what it does with whatever its commands raise."""

import atexit
import contextlib
import io
import re
import resource
import signal
import sys
from collections.abc import Iterator
from types import FrameType

INTERRUPTED, OUT_OF_MEMORY, INTERNAL = 130, 1, 70
LEAST_MEMORY = 1 << 30  # bytes of address space


def main() -> None:
    """Run the command. Whatever goes wrong is one line, and an exit status other than 0."""
    global _interrupt_seen
    _interrupt_seen = False
    # while Python itself ends there is nothing left to interrupt
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
    # a character that the terminal's encoding lacks
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, _ended_by)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, _interrupt)
        _refuse_little_memory()
        # here, so that an interrupt while it is imported ends the same way
        from analysis.cli.commands import app

        _refuse_empty(sys.argv[1:])
        status = app(standalone_mode=False)
        if status == INTERRUPTED:
            raise KeyboardInterrupt
        sys.exit(status if isinstance(status, int) else 0)
    except _EndedBy as end:
        _say(f"ended by {signal.Signals(end.number).name}. Earlier results are untouched")
        raise
    except SystemExit:
        raise
    except KeyboardInterrupt:
        with _undisturbed():
            _say("interrupted. Earlier results are untouched")
        sys.exit(INTERRUPTED)
    except BaseException as error:
        if "--traceback" in sys.argv:
            raise
        with _undisturbed():
            status = _status_of(error)
        sys.exit(status)


def _refuse_little_memory() -> None:
    """End where the libraries would find no room to begin, and try without end."""
    maximum, _ = resource.getrlimit(resource.RLIMIT_AS)
    if maximum != resource.RLIM_INFINITY and maximum < LEAST_MEMORY:
        _say(
            f"memory is limited to {maximum >> 20} MB of address space (ulimit -v). At least "
            f"{LEAST_MEMORY >> 20} MB are needed"
        )
        sys.exit(OUT_OF_MEMORY)


def _refuse_empty(words: list[str]) -> None:
    """Raise ValueError for an empty word: a path of it would be the current folder."""
    for before, word in zip(["", *words], words, strict=False):
        name = word if word.startswith("--") else before if before.startswith("--") else "argument"
        if not word or (word.startswith("--") and word.endswith("=")):
            raise ValueError(f"{name.rstrip('=')}: empty. A value is needed")


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Leave an interrupt aside while the last line is said."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class _EndedBy(SystemExit):
    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.number = number


def _ended_by(number: int, _: FrameType | None) -> None:
    """End as after Ctrl-C: engines and workers are stopped, nothing half written stays. It is said behind
    the last line of progress."""
    raise _EndedBy(number)


_interrupt_seen = False


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _interrupt_seen
    _interrupt_seen = True
    signal.default_int_handler(number, frame)


def _status_of(error: BaseException) -> int:
    """Say what went wrong, in a line, and return the exit status."""
    if _interrupt_seen or type(error).__name__ == "Abort":  # a library that was being imported may make another error of it
        _say("interrupted. Earlier results are untouched")
        return INTERRUPTED
    if hasattr(error, "format_message"):  # words on the command line that typer does not take
        _say(re.sub(r"^Invalid value for '([^']+)': ", r"\1: ", error.format_message()))
        return 2
    if isinstance(error, BrokenPipeError):
        sys.stdout = None  # whoever read it is gone: nothing to flush
        return 128 + signal.SIGPIPE
    if isinstance(error, MemoryError):
        _say("out of memory. Fewer disks, frames or workers need less")
        return OUT_OF_MEMORY
    if words := _words_of(error):
        _say(words)
        return 1
    _say(
        f"a mistake in crowd-percussions, {type(error).__name__}: {error}. Nothing was changed. "
        "The same command with --traceback says where"
    )
    return INTERNAL


def _words_of(error: BaseException) -> str | None:
    """What an error says, where it is no mistake of the program."""
    from analysis.support.extras import missing_extra

    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, (ValueError, OSError)):
        return str(error)
    if isinstance(error, ImportError) and (missing := missing_extra(error)):
        return missing
    # not before: what is wrong may be that this cannot be imported
    from analysis.engines.record import EngineError

    return str(error) if isinstance(error, EngineError) else None


def _say(words: str) -> None:
    print("percussions: " + " ".join(words.split()), file=sys.stderr)
