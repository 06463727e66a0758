"""YADE as an engine: yade_scripts/crowd.py on a scene, without network ports."""

from pathlib import Path

import nscd
from analysis.dumps.contacts import add_arms
from analysis.engines.base import Engine, bodies_apart
from analysis.engines.process import Command
from analysis.engines.record import EngineError
from analysis.scene.scene import Scene


class Yade(Engine):
    """The scripts run by the `yade` on the PATH."""

    NAME, TITLE, COMMAND, ASK = "yade", "YADE", "yade", "--version"
    SAID = r"Yade version: (\S+)"
    INSTALL = "apt-get install --no-install-recommends yade"
    DECKS = "yade_scripts"

    def check(self, scene: Scene) -> None:
        """Raise EngineError for hertz with friction, YADE's tangential spring being another there."""
        contact = scene.contact
        if scene.period_x_m:
            raise EngineError(f"{scene.name}: period_x_m: YADE has none here: use lammps or rigid")
        if message := bodies_apart(scene):
            raise EngineError(f"{scene.name}: {message}")
        if scene.drive and scene.drive.keeps_distance and not _library():
            what = "YADE asks libnscd, which was not built here: use lammps or rigid"
            raise EngineError(f"{scene.name}: drive.time_gap_s: {what}")
        if contact.friction and self.NAME not in contact.kind.friction:
            raise EngineError(
                f"{scene.name}: contact.friction: {contact.friction:g}. YADE runs {contact.law} "
                "without friction here, LAMMPS runs both"
            )

    def command(
        self, folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
    ) -> Command:
        """Return the command that runs what `write_input` wrote."""
        start = (str(self.find()), "-L", "noserver", "-j1", "-n", "-x", f"{decks}/crowd.py")
        inputs = (f"out={out}", f"dt={time_step_s!r}", *(() if guard else ("guard=no",)))
        # the virtual environment's Python path is not for YADE, which brings its own Python
        environment = {
            "PYTHONPATH": str((folder / decks).absolute()),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
            "NSCD_LIBRARY": str(_library() or ""),
        }
        return Command(words=(*start, "scene.toml", *inputs), environment=environment)

    def collect(self, scene: Scene, folder: Path) -> None:
        """Add to contacts.dump who reaches whom with arms."""
        if scene.contact.arms:
            add_arms(folder, scene.contact.arms, scene.wall_segments())


def _library() -> Path | None:
    """The core as programs in C load it, which YADE's own Python can, whatever its version."""
    return next(Path(nscd.__path__[0]).glob("libnscd.*"), None)
