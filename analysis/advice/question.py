"""What is asked of advice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from analysis.scene.scene import Scene
from analysis.work_precision.soft_runs import LAWS
from nscd import find_contacts

Against = Literal["rigid", "model"]
LOADS = {
    "disk-load": "what each disk receives from its contacts",
    "contact-load": "what each contact carries",
    "wall-load": "what all walls together carry",
    "displacement": "where each disk goes",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """What is asked.

    error: a share, at most; rms over all components relative to the rms of the rigid model's.
    quantity: one of LOADS.
    against: `rigid`: numerical and model error count, and law and stiffness are free; `model`: the
    numerical error alone, with the scene's own law and stiffness.
    methods: to choose from.
    whole_run: whether prices and time steps are of the scene's whole run, or of its window."""

    error: float
    quantity: str = "disk-load"
    against: Against = "rigid"
    methods: tuple[str, ...] = ("rigid", "lammps", "yade")
    whole_run: bool = False

    @property
    def load(self) -> str:
        """How the names of the points of the quantity begin."""
        return self.quantity.split("-")[0]

    def laws(self, method: str, scene: Scene) -> tuple[str, ...]:
        """Give the contact laws that a method may have; none for the rigid model."""
        known = LAWS.get(method, ())
        return known if self.against == "rigid" else tuple({scene.contact.law} & set(known))

    def check(self, scene: Scene) -> None:
        """Raise ValueError for a quantity that is unknown, or that the scene cannot have."""
        if self.quantity not in LOADS:
            raise ValueError(f"quantity: unknown {self.quantity!r}; there are: {', '.join(LOADS)}")
        if self.quantity == "displacement" and scene.drive is None:
            raise ValueError(
                f"quantity: displacement is for driven crowds; {scene.name} is an impact, "
                "which takes no time"
            )
        if self.quantity == "wall-load":
            to_press = scene.drive is not None and scene.reconciliation is None
            contacts = find_contacts(
                scene.snapshot, scene.wall_segments(), tolerance=scene.analysis.contact_tolerance_m
            )
            if not scene.walls or not (to_press or contacts.is_wall.any()):
                raise ValueError(
                    f"quantity: wall-load: nobody touches a wall in scene {scene.name}"
                )


def asked_error(text: str) -> float:
    """Read `5%`, `5 %` or `0.05` as a share. Raises ValueError for what is no number above 0 and
    below 1 (100 %)."""
    number = text.strip()
    try:
        share = float(number[:-1]) / 100 if number.endswith("%") else float(number)
    except ValueError:
        share = float("nan")
    if not 0 < share < 1:
        raise ValueError(
            f"error: {text!r}; a share above 0 and below 1 is needed, such as 5% or 0.05"
        )
    return share
