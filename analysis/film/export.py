"""Films for other programs: ParaView (VTK's XML files) and OVITO (dumps as LAMMPS writes them)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from analysis.dumps.contacts import CONTACT_COLUMNS
from analysis.exposure.exposure import loads_of
from analysis.film.frame import ENGINE, Frame, Reel, window_of
from analysis.percussions.setting import FORCE
from analysis.support.files import whole_file, write_text
from analysis.support.frames import write_frame
from nscd.arrays import Floats

Form = Literal["vtk", "ovito"]
# Of what a person bears, the columns that other programs get.
BORNE = ("contact_largest", "contact_sum", "resultant")


def export(reels: Sequence[Reel], form: Form, folder: Path) -> list[Path]:
    """Write every reel into a folder of its own below `folder`; return what to open.

    vtk: film.pvd and one .vtp per frame: people as points, contacts as lines between them (to the
        wall as far as the point that touches), with Σf_n, Σf_t and the number of contacts of each
        pair, where any of the models carries something
    ovito: bodies.dump with what each person bears, and a contacts.dump per model

    Frames without percussions are left out. Columns: docs/columns.md."""
    write = _write_vtk if form == "vtk" else _write_ovito
    names = _names(reels)
    return [path for reel in reels for path in write(reel, folder / form / names[reel.title])]


def _names(reels: Sequence[Reel]) -> dict[str, str]:
    """The names of folders: letters, digits, points and underscores of the titles, and a number
    where two would be one."""
    names: dict[str, str] = {}
    for reel in reels:
        name = re.sub(r"[^\w.]+", "_", reel.title)
        names[reel.title] = name if name not in names.values() else f"{name}_{len(names) + 1}"
    return names


def _unit(frame: Frame, model: str) -> str:
    return "N" if frame.unit(model) == FORCE else "Ns"


def _shown(reel: Reel) -> list[Frame]:
    return [frame for frame in reel.frames if frame.found is not None]


def people_columns(reel: Reel, frame: Frame) -> dict[str, ArrayLike]:
    """Name the columns (n,) of the people of a frame: what they are, and what they bear in each
    model."""
    assert frame.found is not None
    assert frame.match is not None
    now = frame.found.snapshot
    columns: dict[str, ArrayLike] = {"radius": now.radius, "mass": now.mass}
    for model in reel.models:
        borne = loads_of(reel.scene, window_of(frame.match, now, model)).person
        for key in BORNE:
            columns[f"{_model(reel, model)}_{key}_{_unit(frame, model)}"] = borne[key]
    return columns


def _model(reel: Reel, model: str) -> str:
    return reel.engine if model == ENGINE else model


def contact_columns(reel: Reel, frame: Frame) -> dict[str, ArrayLike]:
    """Name the columns (k,) of the contacts of a frame: normal part (positive where it pushes) and
    tangential part of what each model says, and what the mechanics leaves open."""
    assert frame.match is not None
    match, normal = frame.match, frame.match.contacts.normal
    columns: dict[str, ArrayLike] = {"contacts": np.ones(len(match.ids), dtype=np.int64)}
    for model in reel.models:
        vector = match.penalty if model == ENGINE else match.rigid
        name, unit = _model(reel, model), _unit(frame, model)
        columns[f"{name}_fn_{unit}"] = (vector * normal).sum(1)
        columns[f"{name}_ft_{unit}"] = vector[:, 1] * normal[:, 0] - vector[:, 0] * normal[:, 1]
    return columns | {
        "is_wall": match.is_wall.astype(np.int64),
        "determined": frame.determined,
        "lower": frame.lower,
        "upper": frame.upper,
    }


def _write_ovito(reel: Reel, folder: Path) -> list[Path]:
    """The dumps of a reel, a frame of each per frame of the film."""
    bodies = folder / "bodies.dump"
    with whole_file(bodies) as file:
        for frame in _shown(reel):
            assert frame.found is not None
            now = frame.found.snapshot
            n = len(now)
            columns: dict[str, ArrayLike] = {"id": now.ids, "type": np.ones(n, dtype=np.int64)}
            columns |= dict(zip("xyz", (*now.position.T, np.zeros(n)), strict=True))
            columns |= {"vx": now.velocity[:, 0], "vy": now.velocity[:, 1]}
            _append(file, "ATOMS", frame, columns | people_columns(reel, frame))
    written = [bodies]
    for model in reel.models:
        path = folder / f"{_model(reel, model)}_contacts.dump"
        with whole_file(path) as file:
            for frame in _shown(reel):
                _append(file, "ENTRIES", frame, _entries(frame, model))
        written.append(path)
    return written


def _append(file, kind: str, frame: Frame, columns: Mapping[str, ArrayLike]) -> None:  # type: ignore[no-untyped-def]
    write_frame(file, kind, frame.number, list(columns), list(columns.values()))


def _entries(frame: Frame, model: str) -> dict[str, ArrayLike]:
    """The contacts of a model, with the columns of an engine's contact dump."""
    assert frame.match is not None
    match, has = frame.match, frame.has(model)
    vector = match.penalty if model == ENGINE else match.rigid
    overlap = np.maximum(0.0, -match.contacts.gap)
    every = [*match.ids.T, match.is_wall, *match.contacts.normal.T, overlap, *vector.T]
    return dict(zip(CONTACT_COLUMNS, (column[has] for column in every), strict=True))


def _write_vtk(reel: Reel, folder: Path) -> list[Path]:
    """The series of a reel; its index is written last."""
    names = []
    for frame in _shown(reel):
        names.append((frame.time, f"frame_{frame.number:06d}.vtp"))
        write_text(folder / names[-1][1], _poly_data(reel, frame))
    root, collection = _vtk("Collection", "Collection")
    for time, name in names:
        ElementTree.SubElement(collection, "DataSet", timestep=repr(time), part="0", file=name)
    write_text(folder / "film.pvd", _text(root))
    return [folder / "film.pvd"]


def _poly_data(reel: Reel, frame: Frame) -> str:
    """A frame as VTK PolyData: points, then lines between them."""
    assert frame.found is not None
    assert frame.match is not None
    now, match = frame.found.snapshot, frame.match
    kept = np.any([frame.size(model) > 0 for model in reel.models], axis=0)
    wall = match.is_wall[kept]
    n, touching = len(now), match.contacts.point[kept][wall]
    ends = np.column_stack([match.contacts.first, match.contacts.second])[kept]
    ends[wall, 1] = n + np.arange(len(touching))
    places = np.concatenate([now.position, touching])
    root, piece = _vtk("PolyData", "Piece")
    counts = {"NumberOfPoints": len(places), "NumberOfLines": len(ends)}
    counts |= dict.fromkeys(("NumberOfVerts", "NumberOfStrips", "NumberOfPolys"), 0)
    for name, count in counts.items():
        piece.set(name, str(count))
    # what touches a wall there is nobody: its id is 0, and it bears nothing
    people = {"id": now.ids, **people_columns(reel, frame)}
    missing = np.zeros(len(touching))
    _part(piece, "PointData", {k: _longer(v, missing) for k, v in people.items()})
    _part(
        piece, "CellData", {k: np.asarray(v)[kept] for k, v in contact_columns(reel, frame).items()}
    )
    space = np.column_stack([places, np.zeros(len(places))])
    _part(piece, "Points", {"places": space})
    lines = {"connectivity": ends.ravel(), "offsets": 2 * np.arange(1, len(ends) + 1)}
    _part(piece, "Lines", lines)
    return _text(root)


def _longer(values: ArrayLike, by: Floats) -> ArrayLike:
    """People's values, followed by those of the points on walls."""
    kept = np.asarray(values)
    return np.concatenate([kept, by.astype(kept.dtype)])


def _vtk(kind: str, inner: str) -> tuple[ElementTree.Element, ElementTree.Element]:
    """A VTK file of a kind, and the element that is to be filled."""
    root = ElementTree.Element("VTKFile", type=kind, version="1.0", byte_order="LittleEndian")
    if kind == inner:
        return root, ElementTree.SubElement(root, inner)
    return root, ElementTree.SubElement(ElementTree.SubElement(root, kind), inner)


def _part(piece: ElementTree.Element, name: str, arrays: Mapping[str, ArrayLike]) -> None:
    """A part of a piece with its arrays, in digits that give them back."""
    part = ElementTree.SubElement(piece, name)
    for title, values in arrays.items():
        array = np.asarray(values)
        whole = array.dtype.kind in "iub"
        words: Iterable[str] = map(str if whole else repr, (array + 0).ravel().tolist())
        data = ElementTree.SubElement(
            part, "DataArray", type="Int64" if whole else "Float64", Name=title, format="ascii"
        )
        if array.ndim == 2:
            data.set("NumberOfComponents", str(array.shape[1]))
        data.text = " ".join(words)


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
