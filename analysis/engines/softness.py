"""How soft a crowd is: the total drive over stiffness times radius, s = N F/(k r)."""

from __future__ import annotations

from analysis.scene.scene import Scene

# Measured with crowds of 75 to 1,200 at 2·10³ to 10⁸ N/m: below SOUND nobody is deeper than 0.35 r
# in another once the flow is steady; above DOUBTFUL a crowd stands more than a third denser; at
# NO_CROWD disks flow through each other.
SOUND, DOUBTFUL, NO_CROWD = 6.0, 17.0, 50.0


def softness(scene: Scene, stiffness: float | None = None) -> float:
    """Compute s of a driven crowd, at the scene's stiffness (N/m) or another; 0 without a drive.

    F is the mean push m U/τ of a person, r the mean radius."""
    if scene.drive is None:
        return 0.0
    disks, drive = scene.snapshot, scene.drive
    total = float(disks.mass.sum()) * drive.speed_m_per_s / drive.relaxation_time_s
    k = scene.contact.stiffness_N_per_m if stiffness is None else stiffness
    return total / (k * float(disks.radius.mean()))


def softness_warning(scene: Scene) -> str | None:
    """Say before a run that its crowd is too soft; None where it is not."""
    s = softness(scene)
    if s < SOUND:
        return None
    what = (
        "doubtful: it will stand denser than people do"
        if s < DOUBTFUL
        else "not sound: people will be deep in each other"
        if s < NO_CROWD
        else "no crowd: disks will flow through each other"
    )
    return (
        f"the total push over stiffness times radius is {s:.2g} "
        f"(contact.stiffness_N_per_m = {scene.contact.stiffness_N_per_m:.3g}): {what} (below "
        f"{SOUND:g} sound, to {DOUBTFUL:g} doubtful, above {NO_CROWD:g} no crowd)"
    )
