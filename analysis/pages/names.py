"""Names as they stand on a page and in the terminal."""

from analysis.compare.comparison import Comparison
from analysis.engines.softness import VALID, softness
from analysis.pages.numbers import number, significant
from analysis.scene.scene import Scene

ENGINE_NAMES = {"lammps": "LAMMPS", "yade": "YADE", "rigid": "rigid model"}


def engine_name(engine: str) -> str:
    """Name an engine as it writes itself; one that is not known here by its own name."""
    return ENGINE_NAMES.get(engine, engine)


def in_a_sentence(title: str) -> str:
    """Put the article before a title that is no proper name: the rigid model, but LAMMPS."""
    return f"the {title}" if title[:1].islower() else title


def bodies_label(scene: Scene) -> str:
    """Name the bodies of a run with springs: soft near VALID and beyond, else stiff."""
    word = "soft" if softness(scene) > VALID / 2 else "stiff"
    return f"{word}, {significant(scene.contact.stiffness_N_per_m / 1000)} kN/m"


def engine_label(comparison: Comparison) -> str:
    """Name the engine of a run and its stiffness."""
    return (
        f"{engine_name(comparison.record.engine)}, "
        f"k = {number(comparison.scene.contact.stiffness_N_per_m)} N/m"
    )
