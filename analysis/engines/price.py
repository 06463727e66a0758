"""What a run costs, before it is run."""

from dataclasses import dataclass

from analysis.engines import engine as engine_named
from analysis.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """CPU seconds of an engine's run: start_s + disk_step_s · disks · steps."""

    start_s: float
    disk_step_s: float

    def of(self, disk_steps: float) -> float:
        """Give CPU seconds of so many disks times steps."""
        return self.start_s + self.disk_step_s * disk_steps


# By engine and law, on the machine of the stored library, of which they are the fit; that of rigid is
# fitted to `arch`, `jam` and 5,000 people, exact (benchmarks/rigid.py).
PRICES = {
    ("lammps", "hooke"): Price(start_s=0.13255, disk_step_s=2.5082e-7),
    ("lammps", "hertz"): Price(start_s=0.13436, disk_step_s=2.5783e-7),
    ("yade", "hooke"): Price(start_s=0.90817, disk_step_s=1.26862e-6),
    ("rigid", "hooke"): Price(start_s=2.1, disk_step_s=2.5e-6),
}
# What summing impulses costs besides: runs of `arch` of 1 s with and without (benchmarks/converge.py).
IMPULSES = {
    "lammps": Price(start_s=1.9, disk_step_s=4e-7),
    "yade": Price(start_s=0.0, disk_step_s=3.9e-6),
}


def expected_seconds(scene: Scene, engine: str) -> float:
    """Return about how long the engine takes to run the scene (CPU s)."""
    work = len(scene.snapshot) * engine_named(engine).timing(scene).steps
    prices = [PRICES.get((engine, scene.contact.law)) or PRICES[engine, "hooke"]]
    if scene.run.impulses and engine in IMPULSES:
        prices.append(IMPULSES[engine])
    return sum(cost.of(work) for cost in prices)
