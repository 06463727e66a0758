"""Scenes run by the real engines, each once a session."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from analysis.dumps import EngineContacts, index_contacts, index_dump, read_contacts
from analysis.engines import RunRecord
from analysis.engines import run as engine_runs
from analysis.scene.scene import read_scene
from tests.engines.at_hand import require


@dataclass(frozen=True)
class Simulation:
    """A run: its record, what its body dump holds, one array (frames, disks) a column, and its
    contacts a frame."""

    record: RunRecord
    columns: dict[str, np.ndarray]
    contacts: list[EngineContacts]

    def __getitem__(self, column):
        return self.columns[column]

    @property
    def frame_interval(self):
        """Seconds between frames."""
        return self.record.frame_interval * self.record.time_step_s


@pytest.fixture(scope="session")
def simulate(tmp_path_factory):
    """simulate(engine name, scene) → Simulation."""
    done = {}

    def simulation(name, scene):
        require(name)
        key = name, scene.digest()
        if key not in done:
            folder = tmp_path_factory.mktemp("runs") / f"{scene.name} by {name}"
            record = engine_runs.simulate(scene, name, folder)
            index = index_dump(folder / "bodies.dump")
            table = np.array([index.table(frame) for frame in range(len(index.steps))])
            columns = {column: table[:, :, i] for i, column in enumerate(index.columns)}
            assert index_contacts(folder / "contacts.dump").steps == index.steps
            done[key] = Simulation(record, columns, list(read_contacts(folder / "contacts.dump")))
        return done[key]

    return simulation


@pytest.fixture
def impact():
    """impact(scene name, time step, …) → the scene, shortened and with a frame every 10 steps."""

    def scene(name, time_step=1e-5, duration=0.05, every=10, **contact):
        frames = round(duration / time_step / every)
        run = {"duration_s": duration, "frames": frames, "time_step_s": time_step}
        return read_scene(name).with_run(**run).with_contact(**contact)

    return scene


@pytest.fixture(scope="session")
def command():
    """command(words, folder) → the finished process of a command line, with this environment's
    commands first."""

    def run(words, folder, **environment):
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        variables = {**os.environ, "PATH": path, **environment}
        if words[0] == "yade":  # another numpy, which warns of names of instructions that it does not know
            variables.pop("NPY_DISABLE_CPU_FEATURES", None)
        return subprocess.run(
            words,
            cwd=folder,
            env=variables,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )

    return run
