"""Fig. 8: the contact forces of the crowd turbulence against those of the proposed collision."""

from collections.abc import Sequence

from analysis.pages.section import Cell, Section, Verdict
from analysis.pages.words import Words
from analysis.paper.continuum.exit_room import EXIT, MESH, SIDE
from analysis.paper.continuum.fig8_turbulence.charts import error_curves, force_maps
from analysis.paper.continuum.fig8_turbulence.forces import Case
from analysis.paper.continuum.fig8_turbulence.readings import CHECKED, Tried
from analysis.paper.continuum.fig8_turbulence.study import Turbulence, turbulence
from analysis.support.progress import Progress
from nscd.continuum.medium import DENSITY, PERSON, TABLE_1
from nscd.continuum.rivals.density_laws import TurbulencePressure

# forces that differ by this factor depend on δt
DEPENDS = 1.1


def build(progress: Progress | None = None, mesh: float = MESH) -> Section:
    """Build Fig. 8: both forces in one room, every reading of the error, the rival's δt."""
    found, law = turbulence(mesh, progress), TurbulencePressure()
    words = Words(
        __package__,
        **{"found": found, "plain": found.tried[0], "cases": list(Case), "checked": CHECKED},
        **{"side": SIDE, "exit": EXIT, "density": DENSITY, "person": PERSON, "table": TABLE_1},
        jump=float(law.pressure(law.critical_density + 1e-9)),
        sound=[t for t in found.tried if t.reached and t.settled],
    )
    return words.section(
        "8",
        pictures=[
            words.picture("fig_8_error", error_curves(found.curves)),
            words.picture("fig_8_forces", force_maps(found.pairs)),
        ],
        tables=[
            words.table("readings", [_row(tried) for tried in found.tried]),
            words.table("steps", [[*step[:-2], str(step.status)] for step in found.steps]),
        ],
        claims=[words.claim(name, verdict) for name, verdict in verdicts(found).items()],
        warnings=found.warnings,
    )


def verdicts(found: Turbulence) -> dict[str, Verdict]:
    """Judge what the paper says of Fig. 8."""
    return {
        "error": error_verdict(found.tried),
        "friction": Verdict.of(found.grown > DEPENDS),
        "smooth": Verdict.of(found.grown > DEPENDS, found.settled > DEPENDS),
    }


def error_verdict(tried: Sequence[Tried]) -> Verdict:
    """Judge whether a reading gives 10⁻² for k_v ≥ 4, and keeps it on a finer mesh."""
    sound = [t for t in tried if t.settled]
    everywhere, somewhere = (any(getattr(t, name) for t in sound) for name in
                             ("reached", "reached_somewhere"))  # fmt: skip
    return Verdict.of(everywhere, somewhere)


def _row(tried: Tried) -> list[Cell]:
    finer: list[Cell] = ["–", "–"] if tried.finer[0] != tried.finer[0] else tried.finer.tolist()
    return [tried.reading.words, *tried.errors.ravel().tolist(), *finer]
