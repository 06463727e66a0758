"""The contact law of the percussions, as an option."""

import math
from typing import Annotated, Any

import typer


def _law(text: str) -> Any:
    """Read a law: scene (None: the scene's own), inelastic, or a restitution."""
    from nscd import ContactLaw

    if text == "scene":
        return None
    if text == "inelastic":
        return ContactLaw()
    try:
        restitution = float(text)
    except ValueError:
        restitution = math.nan
    if not 0 <= restitution < 1:
        raise typer.BadParameter(
            f"{text}: scene, inelastic or a restitution from 0 to below 1 is needed"
        )
    return ContactLaw(restitution=restitution)


def law_words(law: Any) -> str:
    """Say a law in a few words."""
    bouncing = "inelastic" if not law.restitution else f"restitution {law.restitution:g}"
    return f"{bouncing}, friction {law.friction:g}" if law.friction else bouncing


RigidLaw = Annotated[
    Any,
    typer.Option(
        parser=_law,
        metavar="LAW",
        help="Contact law of the percussions: scene (an impact has the scene's restitution), "
        "inelastic, or a restitution. Left out: scene.",
    ),
]
