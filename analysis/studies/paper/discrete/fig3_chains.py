"""Figure 3: chains of disks, free and against a wall, against their closed forms."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.pages.drawing import (
    BLACK,
    COLOURS,
    GREY,
    LINES,
    MARKERS,
    label,
    legend_below,
    line_style,
    panels,
)
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.discrete.line_of_disks import aligned
from analysis.studies.paper.solutions import grouped, unsolved, with_progress
from analysis.support.parallel import Progress
from nscd import Percussions, Walls, find_contacts, solve
from nscd.arrays import Floats

LENGTHS = (2, 3, 10, 56, 100, 1000, 10_000)
SHOWN = 10
EQUAL, LEAST, MOST = 75.0, 50.0, 100.0  # kg
SPEED = 2.0  # m/s
SEED = 3
TOLERANCE = 1e-10
# Beyond this length only the solver that the product chooses is asked.
OTHER_SOLVER_UP_TO = 1000
KINDS = [(wall, equal) for wall in (False, True) for equal in (True, False)]


class Chain(NamedTuple):
    """A chain of touching disks along x."""

    mass: Floats  # (n,) kg
    left: Floats  # (n,) m/s, left velocities
    wall: bool  # whether a wall stands in front of the last one

    @property
    def words(self) -> tuple[str, str]:
        """How it is held, and its masses."""
        return "wall" if self.wall else "free", "equal" if np.ptp(self.mass) == 0 else "unequal"

    def closed_form(self) -> tuple[Floats, float]:
        """Give λ (contacts,) N·s and u⁺ m/s, for left velocities that press every contact shut.

        Free: U = Σ m u⁻ / Σ m, λ^{i,i+1} = λ^{i−1,i} − m_i (U − u_i⁻), paper (5), (6); wall: 0 and
        Σ_{j≤i} m_j u_j⁻, the last of them the wall's."""
        if self.wall:
            return np.cumsum(self.mass * self.left), 0.0
        common = float(self.mass @ self.left / self.mass.sum())
        reaction: Floats = np.cumsum(self.mass * (self.left - common))[:-1]
        return reaction, common

    def as_printed(self) -> tuple[Floats, float]:
        """Give what (5), (6) say of it, whatever holds it: λ between disks (n−1,) N·s, u⁺ m/s."""
        return Chain(mass=self.mass, left=self.left, wall=False).closed_form()

    def solution(self, solver: str = "auto") -> tuple[Percussions, float]:
        """Give the percussions in the order of the chain, and the CPU time of `solve` (s)."""
        snapshot = aligned(self.mass, self.left)
        end = snapshot.position[-1, 0] + snapshot.radius[-1]
        wall = Walls(start=np.array([[end, -1.0]]), end=np.array([[end, 1.0]]))
        contacts = find_contacts(snapshot, wall if self.wall else None, tolerance=1e-9)
        started = time.process_time()
        found = solve(snapshot, contacts, tolerance=TOLERANCE, solver=solver)
        return found, time.process_time() - started


class Trial:
    """A chain solved, and compared with the closed form.

    cpu: s; reaction_error: of λ over the largest λ; velocity_error: of u⁺ over 2 m/s"""

    def __init__(self, chain: Chain, solver: str = "auto") -> None:
        self.chain, (self.solution, self.cpu) = chain, chain.solution(solver)
        reaction, common = chain.closed_form()
        away = np.abs(self.solution.reaction - reaction).max()
        self.reaction_error = float(away / reaction.max())
        moving = self.solution.right_velocity[:, 0]
        self.velocity_error = float(np.abs(moving - common).max() / SPEED)

    @property
    def name(self) -> str:
        """The chain and the solver in words."""
        kind = ", ".join(self.chain.words)
        return f"chain of {len(self.chain.mass)}, {kind}, {self.solution.solver}"

    def row(self) -> list[Cell]:
        """Disks, how held, masses, largest λ, errors of λ and u⁺, CPU seconds, solver, status."""
        errors, solution = (self.reaction_error, self.velocity_error), self.solution
        largest = float(solution.reaction.max())
        chain = len(self.chain.mass), *self.chain.words
        return [*chain, largest, *errors, self.cpu, solution.solver, str(solution.status)]


def chain_of(n: int, wall: bool, equal: bool) -> Chain:
    """Make a chain of n disks of 75 kg, or 50–100 kg at random (seeded).

    All move at 2 m/s into the wall; a free chain's left velocities fall from 2 to 0 m/s along it,
    so that every contact closes. Raises ValueError for fewer than two disks."""
    if n < 2:
        raise ValueError(f"n: {n}. A chain has at least two disks")
    mass = np.full(n, EQUAL) if equal else np.random.default_rng(SEED).uniform(LEAST, MOST, n)
    left = np.full(n, SPEED) if wall else np.linspace(SPEED, 0.0, n)
    return Chain(mass=mass, left=left, wall=wall)


def solved(progress: Progress | None) -> tuple[list[Trial], list[Trial]]:
    """Solve chains of 2 to 10,000 disks by the solver that the product chooses, shorter ones by
    another too."""
    for solver in ("auto", "interior_point"):
        # loads the compiled code, which is not what is timed
        chain_of(LENGTHS[1], True, False).solution(solver)
    trials, others = [], []
    for case in with_progress([(n, *kind) for n in LENGTHS for kind in KINDS], "chains", progress):
        chain = chain_of(*case)
        trials.append(Trial(chain))
        if case[0] <= OTHER_SOLVER_UP_TO:
            others.append(Trial(chain, "interior_point"))
    return trials, others


def percussions_along(shown: Sequence[Trial]) -> Figure:
    """Draw λ along chains, solver and closed form: free left, against a wall right."""
    figure, (free, wall) = panels(9.5, 4.0, 1, 2, grid="major")
    for axes in (free, wall):
        mine = [trial for trial in shown if trial.chain.wall == (axes is wall)]
        _along(axes, mine)
        n = len(mine[0].solution.reaction)
        names = [f"{i}–{i + 1}" for i in range(1, n + 1)]
        if axes is wall:
            names[-1] = f"{n}–wall"
            printed, _ = mine[0].chain.as_printed()
            words = "(5), (6) as printed, equal"
            axes.plot(range(1, n), printed, "x", ls=":", color=BLACK, label=words)
        axes.set_xticks(range(1, n + 1), names, rotation=45, fontsize=8)
        title, position = ("against a wall", "upper left") if axes is wall else ("free", "lower center")
        label(axes, "contact", "reaction λ (N·s)", title, legend=position)
    return figure


def _along(axes: Axes, trials: Sequence[Trial]) -> None:
    for number, trial in enumerate(trials):
        colour, positions = COLOURS[number], np.arange(1, len(trial.solution.reaction) + 1)
        axes.plot(positions, trial.chain.closed_form()[0], LINES[number], color=colour, lw=1.2)
        face, words = "none" if number else colour, f"{trial.chain.words[1]} masses"
        reaction, marker = trial.solution.reaction, MARKERS[number]
        axes.plot(positions, reaction, marker, color=colour, mfc=face, label=words)


def accuracy(trials: Sequence[Trial]) -> Figure:
    """Draw the error of λ and the CPU seconds against the length, a line for each kind of chain."""
    figure, (left, right) = panels(9.5, 4.0, 1, 2, grid="major")
    smallest = np.finfo(float).eps / 4
    kinds = grouped(trials, lambda trial: trial.chain.words)
    for number, (kind, mine) in enumerate(kinds.items()):
        counts = [len(trial.chain.mass) for trial in mine]
        errors = [max(trial.reaction_error, smallest) for trial in mine]
        for axes, values in ((left, errors), (right, [trial.cpu for trial in mine])):
            axes.plot(counts, values, **line_style(number, hollow=number % 2 == 1), label=", ".join(kind))
    left.axhline(1e-10, color=GREY, lw=1.5, label="10⁻¹⁰")
    people = "people in the chain"
    label(left, people, "error of λ / largest λ (–)", log="xy", ylim=(smallest / 2, 1e-9))
    label(right, people, "CPU time of solve (s)", log="xy")
    legend_below(figure, left, 5)
    return figure


def build(progress: Progress | None = None) -> Section:
    """Build figure 3: λ along chains against the closed forms, up to 10,000 disks."""
    trials, others = solved(progress)
    # the chains of the picture, free and against a wall, each with equal and unequal masses
    shown = [Trial(chain_of(SHOWN, *kind)) for kind in KINDS]
    equal, unequal, _, walled = (trial.solution.reaction for trial in shown)
    change = float(np.abs(unequal - equal).max() / equal.max())
    printed, _ = shown[3].chain.as_printed()
    missed = float(np.abs(printed - walled[:-1]).max() / walled.max())
    free_error = max(trial.reaction_error for trial in trials if not trial.chain.wall)
    # the free chain of unequal masses if all have the same left velocity
    same, _ = shown[1].chain._replace(left=np.full(SHOWN, SPEED)).solution()
    at_one_speed = float(same.reaction.max()), float(np.ptp(same.right_velocity[:, 0]))
    chains = {"shown": shown, "change": change, "printed_miss": missed}
    errors = {"free_error": free_error, "at_one_speed": at_one_speed}
    words = Words(__name__, chains=chains | errors)
    chosen, magnified = (
        words.table("table", [trial.row() for trial in some], what=what)
        for what, some in (
            ("The solver that the product chooses", trials),
            ("The interior point, whose residual long chains magnify,", others),
        )
    )
    return words.section(
        "3",
        pictures={"fig_3_chains": percussions_along(shown), "fig_3_accuracy": accuracy(trials)},
        tables=[chosen, magnified],
        claims={
            "constrained": Verdict.of(missed < 1e-6),
            "free": Verdict.of(free_error < 1e-10),
            "at_one_speed": Verdict.of(max(at_one_speed) < 1e-9),
            "masses": Verdict.of(change > 0.01),
        },
        warnings=unsolved((t.name, t.solution) for t in trials + others),
    )
