"""What all engines have in common; each is a class that says what it does otherwise."""

import shutil
from pathlib import Path

import numpy as np

from analysis.engines.penalty import penalty_of
from analysis.engines.process import Command, digest_of, version_of
from analysis.engines.record import Timing
from analysis.scene.scene import Scene
from analysis.support.files import shipped
from analysis.support.lammps_process import DISTANCE


def bodies_apart(scene: Scene) -> str:
    """Say that people of several disks who keep their distance are not for engines with springs;
    nothing of others."""
    if scene.snapshot.bodies is None or not (scene.drive and scene.drive.keeps_distance):
        return ""
    return "drive.time_gap_s: bodies of several disks keep their distance with rigid only"


class Engine:
    """An engine with springs whose program is on the PATH and runs copies of decks or scripts.

    NAME: in commands and records
    TITLE: in sentences
    COMMAND: the program
    ASK, SAID: its option that says the version, and what it says, a pattern
    INSTALL: the command that installs it
    DECKS: folder of its decks or scripts, beside the packages or in the installed data
    RESUMES: whether it goes on from the dumps of an interrupted run that are in its folder"""

    NAME: str
    TITLE: str
    COMMAND: str
    ASK: str
    SAID: str
    INSTALL: str
    DECKS: str
    RESUMES = False

    def find(self) -> Path | None:
        """Return where its program is."""
        found = shutil.which(self.COMMAND)
        return Path(found) if found else None

    def version(self) -> str | None:
        """Ask the program for its version; None where it is missing or does not start."""
        return version_of(self.find(), self.ASK, self.SAID)

    def decks(self) -> list[Path]:
        """List the decks or scripts."""
        return [path for path in shipped(self.DECKS).iterdir() if path.suffix in (".in", ".py")]

    def deck_digest(self) -> str:
        """Return the digest of what it runs; a run with another is not taken for one with this."""
        return digest_of(self.decks())

    def timing(self, scene: Scene) -> Timing:
        """Return when it steps and writes. Raises ValueError for steps that nobody can count."""
        return penalty_of(scene)

    def setting(self, scene: Scene) -> str:
        """Return what tells its runs of one scene apart, as a part of a folder's name."""
        contact = scene.contact
        walls = f"_w{contact.at_walls:.6g}" if contact.wall_stiffness_N_per_m else ""
        return f"{contact.law}_k{contact.stiffness_N_per_m:.6g}{walls}"

    def check(self, scene: Scene) -> None:
        """Raise EngineError naming the field of a scene that it cannot run."""

    def write_input(self, scene: Scene, decks: Path) -> None:
        """Write all that it reads, but for the scene itself, into a new folder `decks`: copies, since
        a deck cannot name a folder with a space in it."""
        decks.mkdir()
        for deck in self.decks():
            shutil.copyfile(deck, decks / deck.name)
        if scene.drive and scene.drive.keeps_distance:
            row = scene.drive.row(np.sort(scene.snapshot.ids))
            np.savetxt(decks / DISTANCE, row, "%.17g")

    def command(
        self, folder: Path, time_step_s: float, *, decks: str, out: str = ".", guard: bool = True
    ) -> Command:
        """Return the command that runs `scene.toml` of the folder with the input in its subfolder
        `decks` and writes the dumps into its subfolder `out`."""
        raise NotImplementedError

    def collect(self, scene: Scene, folder: Path) -> None:
        """Bring what a run left in the folder into the form of all engines."""
