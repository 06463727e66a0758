"""What solvers say of their answers, and which of these are not solved."""

from collections.abc import Iterable
from typing import Protocol

from nscd.percussions import Status


class Answer(Protocol):
    """What a solver says of its answer."""

    @property
    def status(self) -> Status:
        """Whether it is solved."""

    @property
    def reason(self) -> str:
        """Why it is not."""


def unsolved(answers: Iterable[tuple[str, Answer]]) -> list[str]:
    """Name the answers that are not solved, each with the reason."""
    return [f"{what}: {a.status}: {a.reason}" for what, a in answers if a.status != Status.SOLVED]
