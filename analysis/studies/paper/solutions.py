"""What every figure does with what it found: which answers are not solved, what goes together, and
how far it is."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

from analysis.support.parallel import Progress
from nscd.percussions import Status

Thing = TypeVar("Thing")


class HasStatus(Protocol):
    """What a solver says of its answer."""

    @property
    def status(self) -> Status:
        """Whether it is solved."""

    @property
    def reason(self) -> str:
        """Why it is not."""


def unsolved(solutions: Iterable[tuple[str, HasStatus]]) -> list[str]:
    """Name the answers that are not solved, each with the reason."""
    return [f"{what}: {a.status}: {a.reason}" for what, a in solutions if a.status != Status.SOLVED]


def grouped(things: Iterable[Thing], key: Callable[[Thing], Any]) -> dict[Any, list[Thing]]:
    """Put together the things that have the same key, in the order in which the keys come."""
    groups: dict[Any, list[Thing]] = {}
    for thing in things:
        groups.setdefault(key(thing), []).append(thing)
    return groups


def with_progress(things: Sequence[Thing], label: str, progress: Progress | None) -> Iterator[Thing]:
    """Hand on the things, and tell before each how far it is."""
    for done, thing in enumerate(things, start=1):
        if progress:
            progress(label, done / len(things))
        yield thing
