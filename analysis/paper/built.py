"""A section of a page with what it cost, and what it is called."""

from __future__ import annotations

from dataclasses import dataclass, field

from analysis.engines.ahead import Cost
from analysis.pages.section import Section

STUDIES = {"mesh": "Speed and accuracy", "bridge": "From contacts to stress"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Built:
    """A section, the CPU seconds that it took here, the engine runs made for it first, and whether
    it was taken as it was kept by an earlier build."""

    section: Section
    cpu_seconds: float
    engines: Cost = field(default_factory=Cost)
    kept: bool = False

    @property
    def total_seconds(self) -> float:
        """CPU seconds in all."""
        return self.cpu_seconds + self.engines.cpu_seconds

    @property
    def label(self) -> str:
        """Fig. 8, Section 3.2.1, or the name of a study beside the figures."""
        return label(self.section.number)


def label(number: str) -> str:
    """Fig. 8, Section 3.2.1, or the name of a study beside the figures."""
    if number.isdigit():
        return f"Fig. {number}"
    return STUDIES.get(number, f"Section {number}")
