"""The typer application, and what its commands share: options, progress, tables."""

from __future__ import annotations

import contextlib
import logging
import shlex
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from analysis.support.extras import missing_extra
from analysis.support.files import whole_file
from analysis.support.machine import cores
from analysis.support.parallel import Progress
from analysis.support.reading import NOTE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from analysis.engines.run import EngineRun

# Where there is no terminal, a line of progress every so many seconds.
BETWEEN_LINES_S = 5.0
UNFOLDED = 1000  # columns


class _Commands(TyperGroup):
    """The commands in groups, with the whole of their first sentence."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        groups: dict[str, list[tuple[str, str]]] = {}
        for name, one in self.commands.items():
            words = " ".join((one.help or "").split("\n\n")[0].split())
            groups.setdefault(str(getattr(one, "rich_help_panel", "")), []).append((name, words))
        for title, rows in groups.items():
            with formatter.section(title):
                formatter.write_dl(rows)


class OneCommand(TyperCommand):
    """A command whose arguments stand in its help by name, without their types of Python."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        for one in (one for one in self.params if one.param_type_name == "argument"):
            vars(one)["display_type_rich"] = lambda ctx: ""


# Without rich, whose pages take longer to import than the help to write.
app = typer.Typer(
    cls=_Commands,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Contact forces in a dense crowd: penalty (LAMMPS, YADE) against rigid (percussions), "
    "side by side.",
)


@app.callback(invoke_without_command=True)
def percussions(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Say more.")] = False,
    traceback: Annotated[
        bool, typer.Option("--traceback", help="Show where a mistake is in the program.")
    ] = False,
) -> None:
    """Contact forces in a dense crowd: penalty (LAMMPS, YADE) against rigid (percussions)."""
    logging.getLogger("MDAnalysis").setLevel(logging.ERROR)
    logging.addLevelName(logging.WARNING, "warning")
    logging.addLevelName(logging.INFO, "note")
    logging.addLevelName(NOTE, "note")
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("%(levelname)s: %(message)s"))
    # PedPy gives the root a handler of its own for everybody's notes, where there is none
    others = logging.StreamHandler()
    others.setLevel(logging.WARNING)
    others.addFilter(lambda record: not record.name.startswith("analysis"))
    logging.getLogger().handlers = [others]
    logging.getLogger("pedpy").handlers = logging.getLogger("analysis").handlers = [handler]
    # PedPy gives the root logger a handler
    logging.getLogger("pedpy").propagate = logging.getLogger("analysis").propagate = False
    logging.getLogger("analysis").setLevel(logging.INFO if verbose else NOTE)
    if version:
        from importlib.metadata import version as version_of

        print(f"percussions {version_of('crowd-percussions')}")
    elif context.invoked_subcommand is None:
        print(context.get_help())


@contextlib.contextmanager
def progress() -> Iterator[Progress]:
    """Show progress: bars on a terminal, elsewhere a line on stderr every few seconds."""
    from rich.console import Console
    from rich.progress import Progress as Bars

    console = Console(stderr=True)
    if not console.is_terminal:
        lines, ended = _Lines(), threading.Event()
        beat = threading.Thread(target=lines.beat, args=(ended,), daemon=True)
        beat.start()
        try:
            yield lines.report
        finally:
            ended.set()
            beat.join()
        return
    with Bars(console=console, transient=True) as bars:
        tasks: dict[str, Any] = {}

        def report(label: str, fraction: float) -> None:
            if label not in tasks:
                tasks[label] = bars.add_task(label, total=1.0)
            bars.update(tasks[label], completed=fraction)

        yield report


class _Lines:
    """The latest report, said every few seconds: its share, and the time to go as far as the pace
    between two reports tells it."""

    def __init__(self) -> None:
        self.started = time.monotonic()
        self.first: dict[str, tuple[float, float]] = {}  # time and share of a label's first report
        self.label, self.fraction, self.at = "", 0.0, self.started

    def report(self, label: str, fraction: float) -> None:
        now = time.monotonic()
        self.first.setdefault(label, (now, fraction))
        if (label, fraction) != (self.label, self.fraction):
            self.label, self.fraction, self.at = label, fraction, now

    def beat(self, ended: threading.Event) -> None:
        while not ended.wait(BETWEEN_LINES_S):
            print(self.line(time.monotonic()), file=sys.stderr, flush=True)

    def line(self, now: float) -> str:
        """What is said at a time (s). Nothing of the time to go where only one share is known, or
        where the pace would have brought the end by now."""
        words = f"{self.fraction:.0%}, {lasting(now - self.started)} so far"
        began, done = self.first.get(self.label, (now, self.fraction))
        if done < self.fraction < 1 and self.at > began:
            left = (1 - self.fraction) * (self.at - began) / (self.fraction - done) - (now - self.at)
            words += f", about {lasting(left)} to go" if left > 0 else ""
        return f"{self.label}: {words}" if self.label else words


def lasting(seconds: float) -> str:
    """Write a duration in the unit that suits it: 8 s, 3 min, 2 h, 5 days, 40 years."""
    for unit, longest in (("s", 90), ("min", 90), ("h", 36), ("days", 700)):
        if seconds < longest:
            return f"{max(1, round(seconds))} {unit}"
        seconds /= {"s": 60, "min": 60, "h": 24, "days": 365}[unit]
    return f"{seconds:.2g} years"


def say_expected(cpu_seconds: float, what: str, jobs: int | None = 1) -> None:
    """Say before work that takes long about how long it takes in so many processes (None: as many
    as cores)."""
    seconds = cpu_seconds / (jobs or cores())
    if seconds > BETWEEN_LINES_S:
        print(f"{what}: about {lasting(seconds)}", file=sys.stderr, flush=True)


def refuse_beside(context: typer.Context, names: Iterable[str], why: str) -> None:
    """Raise ValueError for the first of these options that was typed: nothing would come of it."""
    for name in names:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            refuse(why, **{name: source})


def refuse(why: str, **options: object) -> None:
    """Raise ValueError for the first of these options that is given."""
    for name in drop_none(**options):
        raise ValueError(f"--{name.replace('_', '-')}: {why}")


def drop_none(**options: object) -> dict[str, Any]:
    """Keep the options that are given."""
    return {name: value for name, value in options.items() if value is not None}


def say_runs(
    runs: Iterable[EngineRun], what: str = "", seconds: float = 0.0, jobs: int | None = 1
) -> None:
    """Say before runs of engines about how long those take that are not there yet, beside other work of
    so many CPU seconds."""
    from analysis.engines.price import expected_seconds

    missing = [run for run in runs if not run.is_finished()]
    seconds += sum(expected_seconds(run.scene, run.engine) for run in missing)
    say_expected(seconds, what or f"{len(missing)} runs of engines", jobs)


def write_picture(path: Path, draw: Callable[[], Figure]) -> None:
    """Write a picture as PNG and say where. Without the part that draws, say which it is and leave
    the picture out."""
    try:
        from analysis.pages.html import saved

        content = saved(draw(), "png")
    except ImportError as error:
        missing = missing_extra(error)
        if missing is None:
            raise
        print(f"{path}: not drawn: {missing}", file=sys.stderr)
        return
    with whole_file(path, "wb") as file:
        file.write(content)
    print(path)


def warn(words: str) -> None:
    """Write a warning to stderr."""
    print(f"warning: {words}", file=sys.stderr)


def show_page(page: Path) -> None:
    """Say where a page is, as a browser opens it."""
    print(page.resolve().as_uri())


def command_line() -> str:
    """Return the command as it was typed, for the pages."""
    return shlex.join(["percussions", *sys.argv[1:]])


def show(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, numbers_from: int = 1, title: str = ""
) -> None:
    """Print a table, the columns from `numbers_from` on aligned to the right."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title or None, title_justify="left")
    for index, name in enumerate(head):
        table.add_column(
            Text(name), justify="left" if index < numbers_from else "right", overflow="fold"
        )
    for row in rows:
        table.add_row(*map(Text, row))
    # where nobody looks at it, nothing is folded
    Console(width=None if sys.stdout.isatty() else UNFOLDED).print(table)
