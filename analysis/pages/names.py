"""Names as they stand on a page and in the terminal."""

from analysis.compare.comparison import Comparison
from analysis.engines.softness import VALID, known_bodies, softness
from analysis.pages.numbers import number, significant
from analysis.scene.scene import Scene

CHEST = "chest"
ENGINE_NAMES = {"lammps": "LAMMPS", "yade": "YADE", "rigid": "rigid model"}


def engine_name(engine: str) -> str:
    """Name an engine as it writes itself; one that is not known here by its own name."""
    return ENGINE_NAMES.get(engine, engine)


def in_a_sentence(title: str) -> str:
    """Put the article before a title that is no proper name: the rigid model, but LAMMPS."""
    return f"the {title}" if title[:1].islower() else title


def bodies_label(scene: Scene) -> str:
    """Name the bodies of a run with springs: as soft as chests, soft near VALID, else stiff; not valid
    beyond it."""
    chest, k, s = known_bodies()[CHEST], scene.contact.stiffness_N_per_m, softness(scene)
    word = "soft" if s > VALID / 2 else "stiff"
    if chest.low_N_per_m <= k <= chest.high_N_per_m:
        word = CHEST
    return f"{word}, {significant(k / 1000)} kN/m" + (", not valid" if s >= VALID else "")


def engine_label(comparison: Comparison) -> str:
    """Name the engine of a run and its stiffness."""
    return (
        f"{engine_name(comparison.record.engine)}, "
        f"k = {number(comparison.scene.contact.stiffness_N_per_m)} N/m"
    )
