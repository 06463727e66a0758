"""Section 3.2.1: chains as deformable rods against a wall, by P2 elements and in closed form
((12)–(14), corrected). Percussions are in N·s per kg of a person."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from analysis.pages.drawing import COLOURS, LINES, MARKERS, label, panels
from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.studies.paper.continuum.exit_room import MESH
from analysis.studies.paper.solutions import unsolved
from analysis.support.parallel import Progress
from nscd.continuum.closed_forms import Chain, chain_mesh
from nscd.continuum.collision import CollisionAnswer, collide
from nscd.continuum.medium import DENSITY, TABLE_1, table_1_medium
from nscd.continuum.pressure import pressure
from nscd.continuum.space import Space

LENGTH, SPEED = 10.0, 1.7  # m, m/s
VOLUME = TABLE_1.volume_dissipation
# where κ = k_s h/k_v = tanh(l/h)
THRESHOLD = float(np.sqrt(DENSITY * VOLUME) * np.tanh(LENGTH * np.sqrt(DENSITY / VOLUME)))
SURFACES = {
    "sticks, k_s = 0": 0.0,
    "sticks, Table 1": TABLE_1.surface_dissipation,
    "at the threshold": THRESHOLD,
    "rebounds, k_s = 20": 20.0,
}
DENSITIES = (1.0, 2.0, 4.0, 7.0, 14.0)
# people/m at the free end and at the wall; of one mean
PROFILES = ((1.5 * DENSITY, 0.5 * DENSITY), (DENSITY, DENSITY), (0.5 * DENSITY, 1.5 * DENSITY))
FROM_WALL_M = (0.0, 0.5, 1.0, 2.0, 4.0)  # m from the wall
PER_METRE = 20  # cells, for a mesh of 0.2 m in the room
STIFF = 1e3  # times the k_v of Table 1: a chain that is as good as rigid
EQUAL = 0.01  # relative: numbers that agree
ROUNDING = 1e-9  # of the speed, or N·s per kg
STILL = 1e-6  # 1/s: people who do not close up


class Rod:
    """A chain by elements.

    x, right: (n,) m and m/s, the nodes and u⁺
    at_wall: m/s, u⁺ at the wall, 0 where the chain stays
    inner: −σ = −k_v ∂w/∂x at FROM_WALL_M from the wall
    closing: 1/s, how fast people still close up at most"""

    def __init__(self, name: str, solution: CollisionAnswer) -> None:
        self.name, self.solution = name, solution
        order = np.argsort(solution.space.nodes[:, 0])
        self.x, self.right = solution.space.nodes[order, 0], solution.right_velocity[order, 0]
        last = float(self.right[-1])
        self.at_wall = 0.0 if abs(last) < 1e-9 * SPEED else last
        slope = np.gradient(self.right + SPEED, self.x, edge_order=2)
        self.inner = [float(np.interp(LENGTH - at, self.x, -VOLUME * slope)) for at in FROM_WALL_M]
        self.closing = float(-np.gradient(self.right, self.x, edge_order=2).min())


class Trial(Rod):
    """A chain of uniform density (people/m) with k_s, also in closed form.

    error: largest |u⁺ − closed form| over U
    printed_length: m, the h that is printed beside the solution, √((k_s/k_v)/ρ)
    printed: (13) as it stands: k_s/k_v ≥ (e^(−2l/h) − 1)/(e^(−2l/h) + 1)"""

    def __init__(self, name: str, surface: float, density: float, mesh: float) -> None:
        medium = table_1_medium(density, surface=surface, person=1.0)
        super().__init__(name, collide(space_of(mesh), medium, [SPEED]))
        chain = self.chain = Chain(medium=medium, length=LENGTH, left_velocity=SPEED)
        exact = chain.right_velocity(self.x)
        self.error = float(np.abs(self.right - exact).max() / SPEED)
        fraction = medium.k_s / medium.k_v
        self.printed_length = float(np.sqrt(fraction / np.mean(medium.rho)))
        decay = float(np.exp(-2 * chain.length / medium.length))
        self.printed = fraction >= (decay - 1) / (decay + 1)

    def formula_error(self, h: float) -> float:
        """Largest |u⁺ − U(1 − cosh(x/h)/cosh(l/h))| over U, for a length h (m)."""
        formula = SPEED * (1 - np.cosh(self.x / h) / np.cosh(LENGTH / h))
        return float(np.abs(self.right - formula).max() / SPEED)


class Varied(Rod):
    """A chain with k_s of Table 1 whose density changes linearly between its ends (people/m): free
    end, wall.

    rigid: at FROM_WALL_M from the wall for rigid disks of the same masses: the momentum of all who
        stand behind"""

    def __init__(self, first: float, last: float, mesh: float) -> None:
        space = space_of(mesh)
        density = first + (last - first) * space.mesh.p[0] / LENGTH
        solution = collide(space, table_1_medium(density, person=1.0), [SPEED])
        super().__init__(f"{first:g}" if first == last else f"{first:g} to {last:g}", solution)
        self.ends, behind = (first, last), [LENGTH - at for at in FROM_WALL_M]
        rise = 0.5 * (last - first) / LENGTH
        self.rigid = [SPEED * (first * x + rise * x**2) for x in behind]


class FreeChain(NamedTuple):
    """A chain that nothing holds: its wall is behind the last one, who walks away from it.

    from_rigid: how far u⁺ is from ū, the velocity of the rigid chain, over U"""

    name: str
    solution: CollisionAnswer
    from_rigid: float
    pressure: float  # the largest |σ|


def space_of(mesh: float) -> Space:
    """Divide the chain into cells in proportion to a mesh (m)."""
    return Space(chain_mesh(LENGTH, round(LENGTH * PER_METRE * 0.2 / mesh)), 2)


def free_chain(name: str, ends: tuple[float, float], volume: float, mesh: float) -> FreeChain:
    """Solve a free chain whose left velocity goes from one end of `ends` (m/s) to the other."""
    space = space_of(mesh)
    left = ends[0] + (ends[1] - ends[0]) * space.mesh.p[0] / LENGTH
    medium = table_1_medium(volume=volume, surface=0.0, person=1.0)
    solution = collide(space, medium, left[:, None])
    weights = solution.space.weights
    mean = float(solution.left_field.ravel() @ weights / weights.sum())
    rigid = float(np.abs(solution.right_velocity - mean).max() / SPEED)
    return FreeChain(name, solution, rigid, float(np.abs(pressure(solution)).max()))


class Chains:
    """All chains of the section.

    trials, dense: one per name of SURFACES; one per density of DENSITIES, with k_s of Table 1
    varied: one per profile of PROFILES: falling, uniform and rising toward the wall
    free, constant: free chains, of falling left velocity with STIFF k_v, and of a constant one
    factor: the internal percussion by elements 0.5 m from the wall, over (14) as printed
    rigid_factor: how many times as large the percussion of rigid disks is there, at most
    growing: m, the distances of FROM_WALL_M from the wall at which it grows with every density"""

    def __init__(self, mesh: float) -> None:
        k_s = TABLE_1.surface_dissipation
        self.trials = [Trial(name, surface, DENSITY, mesh) for name, surface in SURFACES.items()]
        self.dense = [Trial(f"ρ = {rho:g}", k_s, rho, mesh) for rho in DENSITIES]
        self.varied, self.table_1 = [Varied(*ends, mesh) for ends in PROFILES], self.trials[1]
        self.free = free_chain("free, falling", (0.0, -SPEED), STIFF * VOLUME, mesh)
        self.constant = free_chain("free, constant", (-SPEED, -SPEED), VOLUME, mesh)
        corrected = float(self.table_1.chain.internal_percussion(LENGTH - 0.5))
        self.factor = self.table_1.inner[1] / (corrected / VOLUME)
        self.rigid_factor = max(rod.rigid[1] / rod.inner[1] for rod in self.varied)
        minimum = np.diff([trial.inner for trial in self.dense], axis=0).min(0)
        self.growing = [at for at, rise in zip(FROM_WALL_M, minimum, strict=True) if rise > 0]


def velocities(found: Chains) -> Figure:
    """Draw u⁺ along the chains by elements and in closed form, and r_int for several densities."""
    figure, (left, right) = panels(10.5, 4.4, 1, 2, grid="major")
    for number, one in enumerate(found.trials):
        colour, some = COLOURS[number], slice(number * 5, None, 20)
        left.plot(one.x, one.chain.right_velocity(one.x), LINES[number], color=colour, lw=1.2)
        appearance = {"ls": "none", "ms": 5, "mfc": "none", "color": colour}
        words = one.name.replace("k_s", "$k_s$")
        left.plot(one.x[some], one.right[some], MARKERS[number], **appearance, label=words)
    shades = np.linspace(0.7, 0.0, len(found.dense))
    for one, style, shade in zip(found.dense, (*LINES, (0, (6, 1))), shades, strict=True):
        inner, words = one.chain.internal_percussion(one.x), f"{one.name} people/m"
        right.plot(one.x, inner, ls=style, color=str(shade), lw=1.8, label=words)
    x, near = "x (m), the wall is at the right", (LENGTH - 6, LENGTH + 0.1)
    label(left, x, "right velocity u⁺ (m/s)", legend="lower left", xlim=near)
    y = "internal percussion (N·s per kg of a person)"
    label(right, x, y, log="y", legend="upper left", xlim=near, ylim=(1e-2, None))
    return figure


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build 3.2.1: right velocities of chains that stick and rebound, the statements tried."""
    found = Chains(mesh)
    words = Words(
        __name__,
        **{"found": found, "table": found.table_1, "h": found.table_1.chain.medium.length},
        printed=sum(trial.printed for trial in found.trials),
        rebound=sum(trial.printed != (trial.at_wall == 0) for trial in found.trials),
        right=sum(trial.chain.sticks == (trial.at_wall == 0) for trial in found.trials),
    )
    pairs = [(rod, (("(11)", rod.inner), ("rigid disks", rod.rigid))) for rod in found.varied]
    rods: list[Rod] = [*found.trials, *found.dense, *found.varied]
    free = [(one.name, one.solution) for one in (found.free, found.constant)]
    named = [(rod.name, rod.solution) for rod in rods] + free
    return words.section(
        "3.2.1",
        pictures={"fig_3_2_1_chain": velocities(found)},
        tables={
            "chains": [_row(trial) for trial in found.trials],
            "densities": [[rho, *t.inner] for rho, t in zip(DENSITIES, found.dense, strict=True)],
            "profiles": [[rod.name, model, *inner] for rod, two in pairs for model, inner in two],
        },
        claims=verdicts(found),
        warnings=unsolved((f"chain, {name}", solution) for name, solution in named),
    )


def verdicts(found: Chains) -> dict[str, Verdict]:
    """Judge what the paper says in 3.2.1."""
    table_1, rising = found.table_1, np.diff([rod.inner[1] for rod in found.varied])
    lengths = (table_1.chain.medium.length, table_1.printed_length)
    falls = bool(np.all(np.diff(table_1.inner) < 0))
    free, constant = found.free, found.constant
    return {
        # (13) as printed says what the elements say
        "condition": Verdict.of(all(t.printed == (t.at_wall == 0) for t in found.trials)),
        "solution": Verdict.of(*(table_1.formula_error(h) < EQUAL for h in lengths)),
        "percussion": Verdict.of(abs(found.factor - 1) < EQUAL, falls),
        "increasing": Verdict.of(*(at in found.growing for at in FROM_WALL_M)),
        "glued": Verdict.of(table_1.closing < STILL),
        "variable": Verdict.of(bool(np.all(rising > 0)), found.rigid_factor < 1 + EQUAL),
        "constant": Verdict.of(constant.from_rigid < ROUNDING, constant.pressure < ROUNDING),
        "free": Verdict.of(free.from_rigid < EQUAL),
    }


def _row(trial: Trial) -> list[Cell]:
    chain, solution = trial.chain, trial.solution
    walls = [float(solution.wall_force.sum()), chain.wall_percussion]
    speeds = [trial.at_wall, 0.0 - chain.restitution * SPEED]
    errors = [trial.error, solution.energy.error, solution.residual]
    surface = float(solution.medium.surface_dissipation)
    return [trial.name, surface, *speeds, *walls, *errors, str(solution.status)]
