"""Figure 3: chains of pedestrians, free and against a wall, equal and unequal masses, against the
closed forms."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from analysis.pages.section import Claim, Picture, Section, Table, Verdict
from analysis.paper.discrete.fig3_chains.charts import accuracy, percussions_along
from analysis.paper.discrete.line_of_disks import aligned
from analysis.support.progress import Progress
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """A chain: masses (n,) kg, left velocities along x (n,) m/s, against a wall in front of the
    last one or free."""

    mass: Floats
    left: Floats
    wall: bool

    @property
    def words(self) -> tuple[str, str]:
        """How it is held, and its masses."""
        return "wall" if self.wall else "free", "equal" if np.ptp(self.mass) == 0 else "unequal"

    def closed_form(self) -> tuple[Floats, float]:
        """λ (contacts,) N·s and u⁺ m/s, for left velocities that press every contact shut.

        Free: U = Σ m u⁻ / Σ m, λ^{i,i+1} = λ^{i−1,i} − m_i (U − u_i⁻), paper (5), (6); wall: 0 and
        Σ_{j≤i} m_j u_j⁻, the last of them the wall's."""
        if self.wall:
            return np.cumsum(self.mass * self.left), 0.0
        common = float(self.mass @ self.left / self.mass.sum())
        reaction: Floats = np.cumsum(self.mass * (self.left - common))[:-1]
        return reaction, common

    def answer(self, solver: str = "auto") -> tuple[Percussions, float]:
        """The percussions in the order of the chain, and the CPU time of `solve` (s)."""
        snapshot = aligned(self.mass, self.left)
        end = snapshot.position[-1, 0] + snapshot.radius[-1]
        walls = (
            Walls(start=np.array([[end, -1.0]]), end=np.array([[end, 1.0]])) if self.wall else None
        )
        contacts = find_contacts(snapshot, walls, tolerance=1e-9)
        started = time.process_time()
        found = solve(snapshot, contacts, tolerance=TOLERANCE, solver=solver)
        return found, time.process_time() - started


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """A chain solved: its answer, CPU time (s) and the errors of λ and u⁺ relative to the largest λ
    and to 2 m/s."""

    chain: Chain
    answer: Percussions
    cpu: float
    reaction_error: float
    velocity_error: float

    @classmethod
    def of(cls, chain: Chain, solver: str = "auto") -> Trial:
        """Solve the chain and compare."""
        answer, cpu = chain.answer(solver)
        reaction, common = chain.closed_form()
        return cls(
            chain=chain,
            answer=answer,
            cpu=cpu,
            reaction_error=float(np.abs(answer.reaction - reaction).max() / reaction.max()),
            velocity_error=float(np.abs(answer.right_velocity[:, 0] - common).max() / SPEED),
        )


def chain_of(n: int, wall: bool, equal: bool) -> Chain:
    """n disks of 75 kg, or 50–100 kg at random (seeded). All move at 2 m/s into the wall; a free
    chain's left velocities fall from 2 to 0 m/s along it, so that every contact closes."""
    if n < 2:
        raise ValueError(f"n: {n}; a chain has at least two disks")
    mass = np.full(n, EQUAL) if equal else np.random.default_rng(SEED).uniform(LEAST, MOST, n)
    left = np.full(n, SPEED) if wall else np.linspace(SPEED, 0.0, n)
    return Chain(mass=mass, left=left, wall=wall)


def build(progress: Progress | None = None) -> Section:
    """Figure 3 remade: λ along chains against the closed forms, up to 10,000 disks."""
    trials, others = [], []
    cases = [(n, wall, equal) for n in LENGTHS for wall in (False, True) for equal in (True, False)]
    for solver in ("auto", "interior_point"):
        chain_of(LENGTHS[1], True, False).answer(
            solver
        )  # loads the compiled code, which is not what is timed
    for number, (n, wall, equal) in enumerate(cases):
        chain = chain_of(n, wall, equal)
        trials.append(Trial.of(chain))
        if n <= OTHER_SOLVER_UP_TO:
            others.append(Trial.of(chain, "interior_point"))
        if progress:
            progress("chains", (number + 1) / len(cases))
    shown = [chain_of(SHOWN, wall, equal) for wall in (False, True) for equal in (True, False)]
    answers = [chain.answer()[0] for chain in shown]
    worst = max(trials, key=lambda t: t.reaction_error)
    other = max(others, key=lambda t: t.reaction_error)
    equal_free, unequal_free = answers[:2]
    middle = int(np.argmax(equal_free.reaction)) + 1
    words = [
        f"{len(trials)} chains of {LENGTHS[0]} to {LENGTHS[-1]:,} people, free and against a wall, with equal "
        f"({EQUAL:g} kg) and unequal ({LEAST:g}–{MOST:g} kg) masses. The reactions agree with the closed forms to "
        f"{worst.reaction_error:.1e} of the largest one at worst, the right velocities to "
        f"{max(t.velocity_error for t in trials):.1e}; a second method (interior point, up to {OTHER_SOLVER_UP_TO:,} people) "
        f"to {other.reaction_error:.1e}.",
        f"A free chain whose left velocities fall from {SPEED:g} to 0 m/s is pressed most in its middle: with {SHOWN} equal "
        f"masses {equal_free.reaction.max():.4g} N·s between {middle} and {middle + 1}. Against a wall the percussions add up to "
        f"{answers[2].reaction.max():.4g} N·s at the wall. Unequal masses change the reactions of the free chain by up to "
        f"{_largest_change(equal_free, unequal_free):.0f} % of its largest one.",
    ]
    return Section(
        number="3",
        title="Chains, free and against a wall",
        words=words,
        pictures=[
            Picture(
                name="fig_3_chains",
                caption=f"Reactions along {SHOWN} people: solver (markers) and closed forms (lines). Left, free: the paper's "
                "(5), (6). Right, against a wall, which the paper calls constrained: (5), (6) do not hold there.",
                figure=percussions_along(
                    [
                        (chain.wall, chain.words[1], answer.reaction, chain.closed_form()[0])
                        for chain, answer in zip(shown, answers, strict=True)
                    ],
                    _printed(shown[2])[0],
                ),
            ),
            Picture(
                name="fig_3_accuracy",
                caption="Left: largest error of λ over the largest λ against the length of the chain (0 is drawn at 6e-17). "
                "Right: CPU time of a solution, compiled code loaded.",
                figure=accuracy(
                    [
                        (
                            ", ".join(words),
                            np.array(
                                [
                                    (len(t.chain.mass), t.reaction_error, t.cpu)
                                    for t in trials
                                    if t.chain.words == words
                                ]
                            ),
                        )
                        for words in dict.fromkeys(t.chain.words for t in trials)
                    ]
                ),
            ),
        ],
        tables=[
            _table(trials, "The solver that the product chooses"),
            _table(others, "The interior point, whose residual long chains magnify,"),
        ],
        differs=[
            "(5) and (6) are printed for a constrained chain; they hold for a free one. Against a wall everyone stops and the "
            "reaction is the sum of m u⁻ over all behind.",
            f"The paper gives neither the masses, velocities nor the length of Fig. 3b; these {SHOWN} people are ours.",
        ],
        claims=_claims(trials, shown, answers),
        warnings=[
            f"chain of {len(t.chain.mass)}, {', '.join(t.chain.words)}, {t.answer.solver}: {t.answer.status}: {t.answer.reason}"
            for t in trials + others
            if t.answer.status != "solved"
        ],
    )


def _printed(chain: Chain) -> tuple[Floats, float]:
    """(5), (6) as printed, whatever holds the chain: λ of the contacts between disks (N·s), and u⁺
    (m/s)."""
    return Chain(mass=chain.mass, left=chain.left, wall=False).closed_form()


def _largest_change(equal: Percussions, unequal: Percussions) -> float:
    return 100 * float(np.abs(unequal.reaction - equal.reaction).max() / equal.reaction.max())


def _table(trials: list[Trial], what: str) -> Table:
    return Table(
        caption=f"{what} against the closed forms: errors of λ relative to the largest λ, of u⁺ to {SPEED:g} m/s.",
        head=["people", "chain", "masses", "largest λ (N·s)", "error of λ", "error of u⁺", "CPU (s)", "solver", "status"],
        rows=[
            [
                len(t.chain.mass),
                *t.chain.words,
                float(t.answer.reaction.max()),
                t.reaction_error,
                t.velocity_error,
                t.cpu,
                t.answer.solver,
                str(t.answer.status),
            ]
            for t in trials
        ],
    )  # fmt: skip


def _claims(trials: list[Trial], shown: list[Chain], answers: list[Percussions]) -> list[Claim]:
    free = max(t.reaction_error for t in trials if not t.chain.wall)
    walled, answer = shown[3], answers[3]
    printed, common = _printed(walled)
    size = float(answer.reaction.max())
    miss = float(np.abs(printed - answer.reaction[:-1]).max()) / size
    stopped = float(np.abs(answer.right_velocity).max())
    change = _largest_change(answers[0], answers[1])
    return [
        Claim(
            where="(5), (6)",
            statement="the analytical solution of an aligned constrained pedestrian chain",
            verdict=Verdict.HOLDS if miss < 1e-6 else Verdict.FAILS,
            reason=f"against a wall (6) leaves everyone {common:.3g} m/s where the solver has {stopped:.1e} m/s, and (5) misses "
            f"the reactions by up to {100 * miss:.0f} % of the largest ({size:.4g} N·s)",
        ),
        Claim(
            where="(5), (6)",
            statement="the same formulas, read for a free chain",
            verdict=Verdict.HOLDS if free < 1e-10 else Verdict.FAILS,
            reason=f"largest relative error {free:.1e} over chains of {LENGTHS[0]} to {LENGTHS[-1]:,} people",
        ),
        Claim(
            where="Fig. 3b",
            statement="the difference in the percussion suffered by each pedestrian with identical and different masses",
            verdict=Verdict.HOLDS if change > 1 else Verdict.FAILS,
            reason=f"with {SHOWN} people and the same left velocities the reactions differ by up to {change:.0f} % of "
            "the largest",
        ),
    ]
