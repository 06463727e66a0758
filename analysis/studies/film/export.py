"""Reels of a film: of runs, of dumps and of the heads of a real trajectory; and films for other programs,
ParaView (VTK's XML files) and OVITO (dumps as LAMMPS writes them)."""

import re
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from analysis.dumps import DumpError
from analysis.dumps.contacts import CONTACT_COLUMNS
from analysis.engines.rigid import NAME as RIGID_ENGINE
from analysis.pages.names import engine_name
from analysis.percussions.setting import FORCE
from analysis.scene.real.trajectory import Recording
from analysis.scene.rigid_bodies import people_of
from analysis.studies.exposure.loads import loads_of
from analysis.studies.film.files import FileOptions, FrameFile, of_heads, of_run
from analysis.studies.film.frame import (
    ENGINE,
    OWN,
    Animation,
    Frame,
    FrameRange,
    frame_of,
    window_of,
)
from analysis.support.files import whole_file, write_text
from analysis.support.parallel import Progress, Task, do_all
from analysis.support.write_frames import write_frame
from nscd.percussions import Status

Form = Literal["vtk", "ovito"]
# Of what a person bears, the columns that other programs get.
BORNE = ("contact_largest", "contact_sum", "resultant")


def export(animations: Sequence[Animation], form: Form, folder: Path) -> list[Path]:
    """Write every reel into a folder of its own below `folder`; return what to open.

    vtk: film.pvd and one .vtp per frame: people as points, contacts as lines between them (to the
        wall as far as the point that touches), with Σf_n, Σf_t and the number of contacts of each
        pair, where any of the models carries something
    ovito: bodies.dump with what each person bears, and a contacts.dump per model

    Frames without percussions are left out. Columns: docs/columns.md."""
    write = _write_vtk if form == "vtk" else _write_ovito
    names = _names(animations)
    return [path for animation in animations for path in write(animation, folder / form / names[animation.title])]


def _names(animations: Sequence[Animation]) -> dict[str, str]:
    """The names of folders: titles without other characters, numbered where two would be one."""
    names: dict[str, str] = {}
    for animation in animations:
        name = re.sub(r"[^\w.]+", "_", animation.title)
        names[animation.title] = name if name not in names.values() else f"{name}_{len(names) + 1}"
    return names


def _unit(frame: Frame, model: str) -> str:
    return "N" if frame.unit(model) == FORCE else "Ns"


def people_columns(animation: Animation, frame: Frame) -> dict[str, ArrayLike]:
    """Name the columns (n,) of people: what they are, and what they bear in each model."""
    columns: dict[str, ArrayLike] = {"radius": frame.now.radius, "mass": frame.now.mass}
    of = people_of(frame.now)[1]
    for model in animation.models:
        borne = loads_of(animation.scene, window_of(frame.match, frame.now, model))
        for key in BORNE:
            columns[f"{_model(animation, model)}_{key}_{_unit(frame, model)}"] = borne[key][of]
    return columns


def _model(animation: Animation, model: str) -> str:
    return animation.engine if model == ENGINE else model


def contact_columns(animation: Animation, frame: Frame) -> dict[str, ArrayLike]:
    """Name the columns (k,) of the contacts of a frame: normal part (positive where it pushes) and
    tangential part of what each model says, and what the mechanics leaves open."""
    normal, is_wall = frame.match.contacts.normal, frame.match.is_wall.astype(np.int64)
    columns: dict[str, ArrayLike] = {"contacts": np.ones(len(is_wall), dtype=np.int64)}
    for model in animation.models:
        name, unit, vector = _model(animation, model), _unit(frame, model), frame.vector(model)
        columns[f"{name}_fn_{unit}"] = (vector * normal).sum(1)
        columns[f"{name}_ft_{unit}"] = vector[:, 1] * normal[:, 0] - vector[:, 0] * normal[:, 1]
    columns |= {"is_wall": is_wall, "determined": frame.determined}
    return columns | dict(zip(("lower", "upper"), frame.bounds, strict=True))


def _write_ovito(animation: Animation, folder: Path) -> list[Path]:
    """The dumps of a reel, a frame of each per frame of the film."""
    tables: dict[str, tuple[str, Callable[[Frame], dict[str, ArrayLike]]]] = {
        "bodies.dump": ("ATOMS", partial(_bodies, animation))
    }
    for model in animation.models:
        name = f"{_model(animation, model)}_contacts.dump"
        tables[name] = "ENTRIES", partial(_entries, model=model)
    for name, (kind, columns_of) in tables.items():
        with whole_file(folder / name) as file:
            for frame in animation.shown:
                columns = columns_of(frame)
                write_frame(file, kind, frame.number, list(columns), list(columns.values()))
    return [folder / name for name in tables]


def _bodies(animation: Animation, frame: Frame) -> dict[str, ArrayLike]:
    """The people of a frame, with the columns of an engine's dump and what they bear."""
    now, n = frame.now, len(frame.now)
    columns: dict[str, ArrayLike] = {"id": now.ids, "type": np.ones(n, dtype=np.int64)}
    columns |= dict(zip("xyz", (*now.position.T, np.zeros(n)), strict=True))
    columns |= {"vx": now.velocity[:, 0], "vy": now.velocity[:, 1]}
    return columns | people_columns(animation, frame)


def _entries(frame: Frame, model: str) -> dict[str, ArrayLike]:
    """The contacts of a model, with the columns of an engine's contact dump."""
    match, has = frame.match, frame.has(model)
    overlap = np.maximum(0.0, -match.contacts.gap)
    every = [*match.ids.T, match.is_wall, *match.contacts.normal.T, overlap, *frame.vector(model).T]
    return dict(zip(CONTACT_COLUMNS, (column[has] for column in every), strict=True))


def _write_vtk(animation: Animation, folder: Path) -> list[Path]:
    """The series of a reel; its index is written last."""
    root = _vtk("Collection")
    collection = ElementTree.SubElement(root, "Collection")
    for frame in animation.shown:
        name = f"frame_{frame.number:06d}.vtp"
        write_text(folder / name, _text(_poly_data(animation, frame)))
        time = repr(frame.time)
        ElementTree.SubElement(collection, "DataSet", timestep=time, part="0", file=name)
    write_text(folder / "film.pvd", _text(root))
    return [folder / "film.pvd"]


def _poly_data(animation: Animation, frame: Frame) -> ElementTree.Element:
    """A frame as VTK PolyData: points, then lines between them. What touches a wall there is nobody:
    its id is 0, and it bears nothing."""
    now, match = frame.now, frame.match
    selected = np.any([frame.size(model) > 0 for model in animation.models], axis=0)
    wall = match.is_wall[selected]
    n, in_contact = len(now), match.contacts.point[selected][wall]
    ends = np.column_stack([match.contacts.first, match.contacts.second])[selected]
    ends[wall, 1] = n + np.arange(len(in_contact))
    positions = np.concatenate([now.position, in_contact])
    people = {"id": now.ids, **people_columns(animation, frame)}
    contacts = contact_columns(animation, frame)
    parts: dict[str, dict[str, Any]] = {
        "PointData": {name: np.pad(one, (0, len(in_contact))) for name, one in people.items()},
        "CellData": {name: np.asarray(one)[selected] for name, one in contacts.items()},
        "Points": {"places": np.column_stack([positions, np.zeros(len(positions))])},
        "Lines": {"connectivity": ends.ravel(), "offsets": 2 * np.arange(1, len(ends) + 1)},
    }
    counts = {"NumberOfPoints": str(len(positions)), "NumberOfLines": str(len(ends))}
    counts |= dict.fromkeys(("NumberOfVerts", "NumberOfStrips", "NumberOfPolys"), "0")
    root = _vtk("PolyData")
    piece = ElementTree.SubElement(ElementTree.SubElement(root, "PolyData"), "Piece", counts)
    for name, arrays in parts.items():
        part = ElementTree.SubElement(piece, name)
        for title, array in arrays.items():
            full = array.dtype.kind in "iub"
            about = {"type": "Int64" if full else "Float64", "Name": title, "format": "ascii"}
            if array.ndim == 2:
                about["NumberOfComponents"] = str(array.shape[1])
            data = ElementTree.SubElement(part, "DataArray", about)
            # in digits that give the numbers back
            data.text = " ".join(map(str if full else repr, (array + 0).ravel().tolist()))
    return root


def _vtk(kind: str) -> ElementTree.Element:
    about = {"type": kind, "version": "1.0", "byte_order": "LittleEndian"}
    return ElementTree.Element("VTKFile", about)


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


# Runs whose frames differ by more than this share of the last time are not shown side by side.
SAME = 1e-6


def film_runs(
    folders: Sequence[Path],
    frames: FrameRange | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[Animation]:
    """Make a reel of each finished run.

    frames: of the dumps, from 0; about 50, evenly spread, where left out
    executor: whose workers match and measure the frames; this process where left out

    Runs of one engine are named by their folders too. Raises EngineError and DumpError for a folder
    that does not hold one finished run of its scene, ValueError for a folder that is given twice,
    for frames that are not there and for runs whose frames are not at the same times."""
    complete = [folder.resolve() for folder in folders]
    for number, folder in enumerate(complete):
        if folder in complete[:number]:
            raise ValueError(f"{folders[number]}: is given twice. A film shows a run once")
    how: dict[str, Any] = {"progress": progress, "executor": executor}
    animations = [animation for folder in folders for animation in film_dump(of_run(folder), frames, **how)]
    animations = [
        replace(animation, title=title) for animation, title in zip(animations, _titles(animations, complete), strict=True)
    ]
    times = [np.array([frame.time for frame in animation.frames]) for animation in animations]
    for folder, other in zip(folders[1:], times[1:], strict=True):
        if len(other) != len(times[0]) or np.abs(other - times[0]).max() > SAME * times[0].max():
            raise ValueError(f"{folder}: its frames are not at the times of those of {folders[0]}")
    return animations


def _titles(animations: Sequence[Animation], folders: Sequence[Path]) -> list[str]:
    """The names of engines, with the ends of paths that keep apart runs of one engine."""
    titles = [animation.title for animation in animations]
    depth = next(
        depth
        for depth in range(1, max(len(folder.parts) for folder in folders) + 1)
        if len({folder.parts[-depth:] for folder in folders}) == len(folders)
    )
    return [
        title if titles.count(title) == 1 else f"{title} ({'/'.join(folder.parts[-depth:])})"
        for title, folder in zip(titles, folders, strict=True)
    ]


def film_heads(
    recording: Recording,
    room: Path | None,
    radii: Sequence[float],
    frames: FrameRange | None = None,
    *,
    file_options: FileOptions | None = None,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[Animation]:
    """Make a reel of a recording for each radius (m) of its people, in the order of the radii.

    room: TOML file with walls and drive; what the file holds where left out
    frames: of the file; about 50, evenly spread, where left out
    file_options: what else is said of the file
    executor: whose workers measure the frames; this process where left out

    Frames are those of `of_heads`. One with a reason has the status `failed`. Raises
    TrajectoryError, SceneError and ValueError naming the file, the frame, the person or the key."""
    frames = frames or FrameRange()
    numbers = frames.of(recording.numbers, recording.file)
    animations: list[Animation] = []
    every = sorted(set(radii))
    for radius in every:
        source = of_heads(recording, replace(file_options or FileOptions(), room=room, radius=radius))

        def say(label: str, fraction: float) -> None:
            if progress:
                progress(label, (len(animations) + fraction) / len(every))

        made = _solved(source, numbers, frames.ensemble, say, executor)
        if not any(frame.found is not None and len(frame.now) for frame in made):
            nobody = f"{recording.file}: nobody is inside in any of these frames"
            raise ValueError(next((one.reason for one in made if one.reason), nobody))
        shift = max(0, 1 - int(recording.data.id.min()))
        animation = Animation(title=f"radius {radius:g} m", engine="", scene=source.scene, frames=made)
        animations.append(replace(animation, radius=radius, shift=shift, ensemble=frames.ensemble))
    return animations


def film_dump(
    source: FrameFile,
    frames: FrameRange | None = None,
    *,
    progress: Progress | None = None,
    executor: Executor | None = None,
) -> list[Animation]:
    """Make the one reel of a run, or of a dump of disks: its percussions, and its own contact forces
    where it has some. Arguments as of `film_runs`.

    Raises DumpError naming the file and the step or line, and for one without any contact."""
    frames = frames or FrameRange()
    numbers = frames.of(source.numbers, source.file)
    made = _solved(source, numbers, frames.ensemble, progress, executor)
    if not any(len(frame.determined) for frame in made):
        raise DumpError(f"{source.file}: no contact in any of its frames. There is nothing to see")
    engine = source.engine
    title = source.file.name if engine in ("", OWN) else engine_name(engine)
    animation = Animation(title=title, engine=engine, scene=source.scene, frames=made)
    return [replace(animation, ensemble=frames.ensemble)]


def _solved(
    source: FrameFile,
    numbers: Sequence[int],
    ensemble: bool,
    progress: Progress | None,
    executor: Executor | None,
) -> list[Frame]:
    """The frames of a file, solved one after the other here, and measured by the workers."""
    tasks: list[Task] = []
    label = f"film of {source.file}"
    for index, one in enumerate(source.solve(numbers)):
        if progress:
            progress(label, 0.5 * index / len(numbers))
        if one.found is None:
            tasks.append(Task(call=_failed, arguments=(one.number, one.time, one.reason), work=0.0))
            continue
        shown = None if source.engine == RIGID_ENGINE and not ensemble else ensemble
        scene, call = source.scene, partial(frame_of, ensemble=shown)
        if crowd := one.crowd:
            scene, call = crowd.scene, partial(call, positions=crowd.head_positions, account=crowd.report)
        arguments = (scene, one.number, one.found, one.own)
        tasks.append(Task(call=call, arguments=arguments, work=1.0))

    def say(label: str, fraction: float) -> None:
        if progress:
            progress(label, 0.5 + 0.5 * fraction)

    return list(do_all(tasks, executor, label, say))


def _failed(number: int, time: float, reason: str) -> Frame:
    return Frame(number=number, time=time, status=str(Status.FAILED), reason=reason)
