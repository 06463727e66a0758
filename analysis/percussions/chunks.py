"""Percussions of a dump as a folder of Parquet files, each of some frames: what is finished is
kept."""

import dataclasses
import hashlib
import json
from collections.abc import Iterator
from concurrent.futures import Executor, as_completed
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from analysis.dumps import DumpError
from analysis.percussions.solving import DumpToSolve, SolvedDump, frames_in
from analysis.percussions.table import schema_of
from analysis.support.extras import load
from analysis.support.files import whole_file, write_json
from analysis.support.parallel import Progress
from analysis.support.reading import read_text

# Readers of partitioned Parquet leave files out that begin so.
JOB = "_job.json"
# Under these names a part has, in its metadata, what `SolvedDump` says of it, and a digest of that
# and of what it is a part of.
SUMMARY, SEAL = b"percussions", b"percussions_seal"


def solve_in_chunks(
    dump: DumpToSolve,
    folder: Path,
    frames: int,
    *,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> SolvedDump:
    """Solve a dump into a folder of Parquet files of so many frames each. Parts that are there, of
    the same dump and settings, are not computed again.

    executor: whose workers see the same folders; this process where left out. A part of a worker
        that is lost is computed anew by another where the executor is that of a Dask cluster

    Raises ValueError for a folder that has something else, DumpError as `solve_dump` does; then the
    chunks that are finished stay."""
    dump = dataclasses.replace(dump, parquet=True)
    count = frames_in(dump)
    job = _claim(folder, dump, frames, count)
    chunks = [
        _Chunk(range(start, min(start + frames, count)), folder, job)
        for start in range(0, count, frames)
    ]
    if others := set(folder.glob("*.parquet")) - {part.path for part in chunks}:
        raise ValueError(f"--out: {min(others)}: no part of this dump; remove it")
    found = {part: summary for part in chunks if (summary := part.summary()) is not None}
    todo = [part for part in chunks if part not in found]
    for part, summary in _solved(dump, todo, executor):
        found[part] = summary
        if progress:
            progress(f"percussions of {dump.path}", len(found) / len(chunks))
    for left in folder.glob(".frames_*.part"):  # by workers that were lost
        left.unlink(missing_ok=True)
    whole = SolvedDump(unsolved=[])
    for part in chunks:
        whole.join(found[part])
    if not whole.contacts:
        raise DumpError(
            f"{dump.path}: no contact in any frame (gap ≤ {dump.setting.contact_tolerance:g} m)"
        )
    return whole


@dataclasses.dataclass(frozen=True, slots=True)
class _Chunk:
    """Some frames, the folder that they are written into, and what they are of, as JSON."""

    numbers: range
    folder: Path
    job: str

    @property
    def path(self) -> Path:
        return self.folder / f"frames_{self.numbers[0]:08d}_{self.numbers[-1]:08d}.parquet"

    def solve(self, dump: DumpToSolve) -> SolvedDump:
        """Solve the frames and write them; what comes back is small."""
        arrow, parquet = load("pyarrow"), load("pyarrow.parquet")
        summary, batches, columns = SolvedDump(unsolved=[]), [], None
        for block in dump.blocks(self.numbers):
            for some in dump.solve(block):
                summary.join(some.said)
                if some.said.contacts or columns is None:
                    columns = some.columns
                if some.said.contacts:
                    batches.append(some.rows)
        schema = schema_of(columns or [])
        said = json.dumps(dataclasses.asdict(summary))
        about = {SUMMARY: said, SEAL: self._seal(said)}
        table = arrow.Table.from_batches(batches, schema).replace_schema_metadata(about)
        with whole_file(self.path, "wb") as file:
            parquet.write_table(table, file, write_page_checksum=True)
        return summary

    def _seal(self, said: str) -> str:
        """What only a part of this job, that says this, has."""
        return hashlib.sha256(f"{self.job}\n{self.numbers}\n{said}".encode()).hexdigest()

    def summary(self) -> SolvedDump | None:
        """What a finished part says of itself; None where there is none. Raises ValueError for a
        part of something else."""
        if not self.path.exists():
            return None
        arrow, parquet = load("pyarrow"), load("pyarrow.parquet")
        try:
            with parquet.ParquetFile(self.path, page_checksum_verification=True) as file:
                about = file.schema_arrow.metadata or {}
                rows = sum(len(batch) for batch in file.iter_batches())
        except (arrow.ArrowException, OSError):
            return None  # cut off or damaged, as by a full disk: it is computed again
        said = about.get(SUMMARY, b"").decode("utf-8", "replace")
        if about.get(SEAL, b"") != self._seal(said).encode():
            raise ValueError(
                f"--out: {self.path}: no part of this dump and these settings; remove it"
            )
        found = SolvedDump(**json.loads(said))
        return found if rows == found.contacts else None


def _solved(
    dump: DumpToSolve, chunks: list[_Chunk], executor: Executor | None
) -> Iterator[tuple[_Chunk, SolvedDump]]:
    if executor is None:
        for part in chunks:
            yield part, part.solve(dump)
        return
    pending: dict[Any, _Chunk] = {executor.submit(part.solve, dump): part for part in chunks}
    try:
        for future in as_completed(pending):
            yield pending[future], future.result()
    finally:
        for future in pending:
            future.cancel()


def _claim(folder: Path, dump: DumpToSolve, frames: int, count: int) -> str:
    """Say in a folder what its chunks are of, and return it. Raises ValueError where it has
    others."""
    job = _job_of(dump, frames, count)
    place = folder / JOB
    if not place.exists():
        if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
            raise ValueError(
                f"--out: {folder}: it is there, and no folder of parts; give another name"
            )
        write_json(place, job)
        return json.dumps(job)
    try:
        known = json.loads(read_text(place))
        other = [name for name in job if known.get(name) != job[name]]
    except (ValueError, AttributeError):
        raise ValueError(f"{place}: not what is written there; give another --out") from None
    if other:
        raise ValueError(
            f"--out: {folder}: its parts are of another {other[0]} ({_short(known.get(other[0]))} "
            f"where this is {_short(job[other[0]])}); give another name, or remove it"
        )
    return json.dumps(job)


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}…"


def _job_of(dump: DumpToSolve, frames: int, count: int) -> dict[str, Any]:
    """Everything that the answers depend on, as JSON has it."""
    about = dump.path.stat()
    job = {
        "dump": {"name": dump.path.name, "bytes": about.st_size, "changed_ns": about.st_mtime_ns},
        "frames": count,
        "frames per part": frames,
        "version": version("crowd-percussions"),
        "time step": dump.time_step,
        "unit": dump.unit,
        "tolerance": dump.tolerance,
        "openness": dump.openness,
        "law": _plain(dump.law),
        "setting": _plain(dump.setting),
    }
    return dict(json.loads(json.dumps(job)))


def _plain(value: Any) -> Any:
    """A value as what JSON has."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if dataclasses.is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    return value.tolist() if isinstance(value, np.ndarray) else value
