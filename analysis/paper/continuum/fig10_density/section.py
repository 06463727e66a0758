"""Fig. 10: pressure and speed against the density, by the collision and by constitutive laws."""

from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.answers import unsolved
from analysis.paper.continuum.exit_room import MESH
from analysis.paper.continuum.fig10_density import study
from analysis.paper.continuum.fig10_density.charts import curves
from analysis.paper.continuum.fig10_density.study import Densities, Solved
from analysis.support.progress import Progress
from nscd.continuum.medium import PERSON

SHOWN = (1.0, 3.5, 5.5, 7.0, study.GREATEST)  # people/m²
# slower than this share of the free speed counts as congested
CONGESTED = 0.1
# pressures within this factor of each other belong on one axis
ONE_AXIS = 10.0


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 10: what (11) gives for each density, beside (M1), (M2), (L1) and (L2)."""
    found = study.densities(mesh, progress)
    words = Words(
        __package__,
        **{"found": found, "first": found.free[0], "last": found.free[-1], "here": found.here},
        **{"study": study, "person": PERSON},
        adapted=found.adapted_speed(study.GREATEST),
    )
    return words.section(
        "10",
        pictures=[words.picture("fig_10_density", curves(found))],
        tables=[
            words.table("densities", [_row(s, found) for s in found.free if s.density in SHOWN])
        ],
        claims=[words.claim(name, verdict) for name, verdict in verdicts(found).items()],
        warnings=unsolved(found.answers),
    )


def verdicts(found: Densities) -> dict[str, Verdict]:
    """Judge what the paper says of Fig. 10."""
    first, last, slow = found.free[0], found.free[-1], CONGESTED * study.FREE_SPEED
    moving = [last.mean_speed > slow, found.adapted_speed(last.density) > slow]
    stopped = all(speed < slow for speed in last.laws)
    return {
        "one_axis": Verdict.of(*(1 / ONE_AXIS < ratio < ONE_AXIS for ratio in found.factors)),
        "congestion": Verdict.of(*moving) if stopped else Verdict.FAILS,
        "speed": Verdict.of(
            last.mean_speed != first.mean_speed, last.mean_speed < first.mean_speed
        ),
    }


def _row(solved: Solved, found: Densities) -> list[Cell]:
    return [
        solved.density,
        solved.largest / study.STEP,
        solved.mean / study.STEP,
        solved.measured,
        PERSON * solved.printed,
        solved.power,
        solved.turbulence,
        solved.mean_speed,
        found.adapted_speed(solved.density),
        *solved.laws,
        solved.answer.residual,
        str(solved.answer.status),
    ]
