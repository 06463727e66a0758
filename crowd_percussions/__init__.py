"""One name for the whole product: what `nscd` and `analysis` offer, each imported when first used.

>>> import crowd_percussions as cp
>>> two = cp.Snapshot(
...     position=[[0, 0], [0.5, 0]], velocity=[[2, 0], [0, 0]], radius=[0.25, 0.25], mass=[75, 75]
... )
>>> cp.solve(two, cp.find_contacts(two, tolerance=1e-9)).impulse  # N·s
array([[75.,  0.]])
"""

from __future__ import annotations

import ast
import importlib
import sys
import warnings
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # the same names for who reads types: `x as x` hands on
    from analysis import compare as compare
    from analysis import dumps as dumps
    from analysis import engines as engines
    from analysis import percussions as percussions
    from analysis import scene as scene
    from analysis.compare import Comparison as Comparison
    from analysis.compare import compare_run as compare_run
    from analysis.dumps import DumpError as DumpError
    from analysis.dumps import open_bodies as open_bodies
    from analysis.dumps import read_contacts as read_contacts
    from analysis.dumps import snapshot_of as snapshot_of
    from analysis.engines import EngineError as EngineError
    from analysis.engines.run import simulate as simulate
    from analysis.percussions import PercussionAnalysis as PercussionAnalysis
    from analysis.percussions import Setting as Setting
    from analysis.percussions import percussions_of as percussions_of
    from analysis.percussions.audit import Audit as Audit
    from analysis.percussions.audit import audit as audit
    from analysis.scene import Crowd as Crowd
    from analysis.scene import Doorway as Doorway
    from analysis.scene import Inside as Inside
    from analysis.scene import Scene as Scene
    from analysis.scene import SceneError as SceneError
    from analysis.scene import from_geometry as from_geometry
    from analysis.scene import opposing as opposing
    from analysis.scene import read_room as read_room
    from analysis.scene import read_scene as read_scene
    from analysis.scene import room as room
    from analysis.scene import scene_names as scene_names
    from analysis.scene.real.import_crowd import import_crowd as import_crowd
    from analysis.scene.real.trajectory import read_heads as read_heads
    from analysis.scene.shipped_scenes import make as make
    from analysis.studies.advice.candidates import Question as Question
    from analysis.studies.advice.choice import advise as advise
    from analysis.studies.advice.library import stored_library as stored_library
    from analysis.studies.exchange.fclib import read_problem as read_problem
    from analysis.studies.exchange.fclib import write_answer as write_answer
    from analysis.studies.exchange.fclib import write_problem as write_problem
    from analysis.studies.exchange.jupedsim import RigidPeople as RigidPeople
    from analysis.studies.exposure.limits import known_limits as known_limits
    from analysis.studies.exposure.loads import read_exposure as read_exposure
    from analysis.studies.exposure.pedestrians import trajectory as trajectory
    from analysis.studies.infer.inference import infer as infer
    from analysis.studies.infer.inference import run_prior as run_prior
    from analysis.studies.infer.observations import see as see
    from analysis.support.files import shipped as shipped
    from nscd import ContactLaw as ContactLaw
    from nscd import Contacts as Contacts
    from nscd import ContactState as ContactState
    from nscd import Percussions as Percussions
    from nscd import Snapshot as Snapshot
    from nscd import Status as Status
    from nscd import Walls as Walls
    from nscd import continuum as continuum
    from nscd import find_contacts as find_contacts
    from nscd import friction as friction
    from nscd import indeterminacy as indeterminacy
    from nscd import solve as solve
    from nscd import stepping as stepping
    from nscd.gradients import NoGradientError as NoGradientError
    from nscd.gradients import gradient as gradient
    from nscd.indeterminacy import Determinacy as Determinacy
    from nscd.indeterminacy import determinacy as determinacy
    from nscd.indeterminacy.intervals import interval as interval
    from nscd.indeterminacy.intervals import weights_of_contacts as weights_of_contacts
    from nscd.show import draw as draw
    from nscd.stepping import Motion as Motion

    __version__: str

_PACKAGES = ("nscd", "analysis")
# The names above, and where each is from: this file says it once, to readers of types and to Python.
_HOMES = {
    alias.name: node.module or ""
    for node in ast.walk(ast.parse(Path(__file__).read_text(encoding="utf-8")))
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
    if alias.name == alias.asname
}

__all__ = sorted(_HOMES)


class _Beside:
    """Find `nscd` and `analysis` beside this package, whatever else has their names."""

    root = Path(__file__).resolve().parents[1]

    @classmethod
    def find_spec(cls, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Find a package as Python's import asks for it."""
        return PathFinder.find_spec(name, [str(cls.root)]) if name in _PACKAGES else None

    @classmethod
    def first(cls) -> None:
        """Be asked first. Raises ImportError where another package of the name is in use, and warns
        of one that can no longer be imported."""
        for name in _PACKAGES:
            had = getattr(sys.modules.get(name), "__file__", None)
            found = PathFinder.find_spec(name)
            other = had or (found.origin if found else None)
            if other is None or Path(other).resolve().is_relative_to(cls.root / name):
                continue
            if had:
                raise ImportError(
                    f"{other}: {name} is also a package of crowd-percussions, and both are needed "
                    "here: rename this one"
                )
            warnings.warn(
                f"{other}: `import {name}` gives the package of crowd-percussions from now on. "
                "Rename this one",
                stacklevel=3,
            )
        sys.meta_path.insert(0, cls)


_Beside.first()


def __getattr__(name: str) -> Any:
    """Import what is asked for, once."""
    if name == "__version__":
        found: Any = importlib.import_module("importlib.metadata").version("crowd-percussions")
    elif name in _HOMES:
        found = getattr(__import__(_HOMES[name], fromlist=[name]), name)
    else:
        raise AttributeError(f"crowd_percussions has no {name!r}. See dir(crowd_percussions)")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
