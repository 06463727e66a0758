"""The small crowds of the atlas: lines, closed rooms and triangular packings, as scenes without a
file."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh, spsolve

from analysis.engines.penalty import penalty_of
from analysis.scene.scene import Drive, Scene
from analysis.scene.schema import Analysis, ContactModel, Run, Wall
from nscd import Contacts, Snapshot, Walls, find_contacts
from nscd.arrays import Floats

RADIUS_M, MASS_KG, STIFFNESS_N_PER_M = 0.25, 75.0, 1e6
# √(m/k): the time in which these penalty contacts answer (s).
PERIOD_S = math.sqrt(MASS_KG / STIFFNESS_N_PER_M)
PRESSED = 1e-3  # overlap of a pressed packing over the radius
FRAMES = 20
WALKING_M_PER_S, RELAXATION_S = 1.0, 0.5
ELASTIC = ContactModel(stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=1.0)


def disks(
    position: ArrayLike, velocity: ArrayLike = (0.0, 0.0), mass: ArrayLike = MASS_KG
) -> Snapshot:
    """Make disks of RADIUS_M at position (n,2) m with velocity (n,2) m/s and mass (n,) kg, or one
    velocity and mass for all."""
    positions = np.asarray(position, dtype=np.float64)
    n = len(positions)
    return Snapshot(
        position=positions,
        velocity=np.broadcast_to(np.asarray(velocity, dtype=np.float64), (n, 2)),
        radius=np.full(n, RADIUS_M),
        mass=np.broadcast_to(np.asarray(mass, dtype=np.float64), (n,)),
    )


def scene_of(
    snapshot: Snapshot,
    run: Run,
    *,
    contact: ContactModel = ELASTIC,
    walls: Sequence[Wall] = (),
    drive: Drive | None = None,
) -> Scene:
    """Make a scene of the disks for a trial."""
    return Scene(
        name="trial",
        title="a trial of the atlas",
        source="made for the atlas",
        snapshot=snapshot,
        walls=tuple(walls),
        drive=drive,
        contact=contact,
        run=run,
        analysis=Analysis(kind="impact"),
    )


def contacts_of(snapshot: Snapshot, walls: Sequence[Wall] = ()) -> Contacts:
    """Find the contacts of disks and walls that touch to 1e-6 m."""
    ends = np.array([(wall.start_m, wall.end_m) for wall in walls]).reshape(-1, 2, 2)
    return find_contacts(snapshot, Walls(start=ends[:, 0], end=ends[:, 1]), tolerance=1e-6)


def walking_drive(door: tuple[tuple[float, float], tuple[float, float]]) -> Drive:
    """Make the drive of people who walk along x to a door from its one end to the other (m)."""
    return Drive(
        speed_m_per_s=WALKING_M_PER_S,
        relaxation_time_s=RELAXATION_S,
        door_start_m=door[0],
        door_end_m=door[1],
        outward=(1.0, 0.0),
    )


def line(n: int, spacing: float = 2 * RADIUS_M) -> Floats:
    """Place n disks along x from the origin, touching unless spaced otherwise: their
    centres (n,2) m."""
    return np.column_stack([spacing * np.arange(n), np.zeros(n)])


def end_walls(low: float, high: float) -> tuple[Wall, Wall]:
    """Make two upright walls at x = low and x = high (m)."""
    half = 8 * RADIUS_M
    return (
        Wall(name="left", start_m=(low, -half), end_m=(low, half)),
        Wall(name="right", start_m=(high, -half), end_m=(high, half)),
    )


def rhombus(across: int, spacing: float = 2 * RADIUS_M) -> Floats:
    """Place across² disks on the triangular lattice with the basis spacing·(1, 0), spacing·(½,
    √3/2), (n,2) m: touching unless spaced otherwise, and then each inner one has six contacts."""
    i, j = np.meshgrid(np.arange(across), np.arange(across), indexing="ij")
    x = spacing * (i + 0.5 * j).ravel()
    return np.column_stack([x, spacing * (np.sqrt(0.75) * j).ravel()])


def rhombus_walls(
    across: int, spacing: float = 2 * RADIUS_M, distance: float = RADIUS_M
) -> tuple[Wall, ...]:
    """Make four walls round the rhombus, at a distance (m) from its outer centres."""
    first, second = np.array([1.0, 0.0]), np.array([0.5, np.sqrt(0.75)])
    side, reach = spacing * (across - 1), distance / np.sqrt(0.75)
    corners = [
        -reach * (first + second),
        side * first + reach * (first - second),
        side * (first + second) + reach * (first + second),
        side * second + reach * (second - first),
    ]
    ends = [(float(corner[0]), float(corner[1])) for corner in corners]
    sides = zip(("low", "right", "high", "left"), ends, ends[1:] + ends[:1], strict=True)
    return tuple(Wall(name=name, start_m=a, end_m=b) for name, a, b in sides)


def corner_walls(across: int) -> list[Wall]:
    """Make the two walls of the rhombus' lower left corner."""
    return [wall for wall in rhombus_walls(across) if wall.name in ("low", "left")]


def pressed_rhombus(across: int, restitution: float) -> Scene:
    """Make a rhombus that its walls press so that every contact has an overlap, at rest in the
    penalty model: lattice constant (2 − PRESSED)r, then Newton's method on the forces
    Σ k·overlap·n = 0."""
    spacing = (2 - PRESSED) * RADIUS_M
    # three inner disks push an outer one with √3 of a contact force
    walls = rhombus_walls(across, spacing, RADIUS_M * (1 - np.sqrt(3) * PRESSED))
    return at_rest(_pressed(rhombus(across, spacing), walls, restitution))


def pressed_line(n: int, restitution: float) -> Scene:
    """Make n disks in a line that two walls press: every contact has the overlap PRESSED·r."""
    spacing = (2 - PRESSED) * RADIUS_M
    reach = RADIUS_M * (1 - PRESSED)
    walls = end_walls(-reach, spacing * (n - 1) + reach)
    return _pressed(line(n, spacing), walls, restitution)


def _pressed(position: Floats, walls: Sequence[Wall], restitution: float) -> Scene:
    contact = ContactModel(stiffness_N_per_m=STIFFNESS_N_PER_M, restitution=restitution)
    run = Run(duration_s=1.0, frames=FRAMES)
    return scene_of(disks(position), run, contact=contact, walls=walls)


def at_rest(scene: Scene) -> Scene:
    """Move the disks of a scene to where the penalty forces Σ k·overlap·n vanish. Raises ValueError
    if six steps of Newton's method do not bring them below 1e-9 of the largest contact force."""
    position = np.array(scene.snapshot.position)
    k = scene.contact.stiffness_N_per_m
    for _ in range(6):
        contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=0.0)
        closing = contacts.normal_matrix(len(scene.snapshot))
        force = closing.T @ (k * contacts.gap)
        if np.abs(force).max() <= 1e-9 * k * np.abs(contacts.gap).max():
            return scene
        stiffness = (k * (closing.T @ closing)).tocsc()
        position = position + spsolve(stiffness, force).reshape(-1, 2)
        snapshot = dataclasses.replace(scene.snapshot, position=position)
        scene = scene.model_copy(update={"snapshot": snapshot})
    raise ValueError("position: the packing has no state of rest near the one given")


def kicked(scene: Scene, fraction: float, seed: int = 1) -> Scene:
    """Give the scene random velocities CᵀCξ (ξ normal, the same for a seed) of kinetic energy share
    · elastic energy: they work on contacts only, so that a pressed line does not buckle."""
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=0.0)
    elastic = 0.5 * scene.contact.stiffness_N_per_m * float((contacts.gap**2).sum())
    closing = contacts.normal_matrix(len(scene.snapshot))
    random = np.random.default_rng(seed).normal(size=2 * len(scene.snapshot))
    velocity = (closing.T @ (closing @ random)).reshape(-1, 2)
    kinetic = 0.5 * float(scene.snapshot.mass @ (velocity**2).sum(1))
    velocity *= np.sqrt(fraction * elastic / kinetic)
    moving = dataclasses.replace(scene.snapshot, velocity=velocity)
    return scene.model_copy(update={"snapshot": moving})


def critical_time_step(scene: Scene) -> float:
    """Compute the largest time step (s) for which leapfrog is stable on the scene's contacts, all
    of them kept closed.

    x(t+Δ) − 2x + x(t−Δ) = −Δ²M⁻¹K x − ΔM⁻¹C (x − x(t−Δ)), K = Σ k nnᵀ, C = Σ c nnᵀ: the eigenvalue
    −1 of the map appears when Δ²K + 2ΔC − 4M is first singular, which is Δ = 2/ω_max for c = 0 and
    Δω = 2(√(1+ζ²) − ζ) for one mode. Dampers act with the velocity of the half step before, as they
    do in both engines."""
    contacts = find_contacts(scene.snapshot, scene.wall_segments(), tolerance=0.0)
    penalty, n = penalty_of(scene), len(scene.snapshot)
    root = diags_array(np.repeat(scene.snapshot.mass, 2) ** -0.5)
    closing = contacts.normal_matrix(n) @ root
    dashpot = np.where(contacts.is_wall, penalty.wall_damping, penalty.damping)
    stiffness = closing.T @ closing * penalty.stiffness
    damping = closing.T @ diags_array(dashpot) @ closing

    def largest(matrix: csr_array) -> float:
        if matrix.shape[0] < 3:
            return float(np.linalg.eigvalsh(matrix.toarray())[-1])
        maximum = eigsh(matrix.tocsc(), k=1, which="LA", tol=1e-12, return_eigenvectors=False)
        return float(maximum[0])

    undamped = 2 / np.sqrt(largest(stiffness))
    if not dashpot.any():
        return float(undamped)
    return float(
        brentq(
            lambda step: largest(step**2 * stiffness + 2 * step * damping) - 4,
            1e-6 * undamped,
            1.000001 * undamped,
            xtol=1e-14 * undamped,
            rtol=1e-12,
        )
    )
