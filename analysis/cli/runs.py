"""Commands that compute (run, solve, export), and doctor."""

from __future__ import annotations

import functools
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from analysis.cli import app
from analysis.cli.options import (
    Count,
    DumpOptions,
    Factor,
    Indeterminacy,
    InputFile,
    Out,
    Positive,
    Processes,
    Share,
    one_dump,
)

if TYPE_CHECKING:
    from analysis.percussions import Setting, SnapshotPercussions
    from analysis.percussions.solve_dump import DumpToSolve, SolvedDump
    from analysis.scene.scene import Room


def run(
    scene: str,
    *,
    engine: str | None = None,
    error: str | None = None,
    stiffness: Positive | None = None,
    wall_stiffness: Positive | None = None,
    restitution: Share | None = None,
    law: str | None = None,
    time_step: Positive | None = None,
    duration: Positive | None = None,
    impulses: bool = False,
    exact: bool = False,
    ranks: Processes = 1,
    out: Out = Path("out"),
) -> None:
    """Run a scene with one engine.

    engine: lammps, yade or rigid. Default: lammps, or what --error chooses.
    error: Let law, stiffness and time step be advised for this error, such as 5%.
    stiffness: Contact stiffness in N/m, instead of the scene's.
    wall_stiffness: The same of walls in N/m, instead of the scene's.
    restitution: Asked restitution, 0 to 1.
    law: hooke, hertz, body or body_hertz.
    time_step: Time step in s, instead of the rule's.
    duration: Simulated time in s.
    impulses: Sum the impulses of contacts between frames, for `exposure`. A run of LAMMPS then takes
        1.5 to 5 times as long. The rigid engine always sums them.
    exact: Solve each step to 1e-8, with friction too. The rigid engine only.
    ranks: Processes of MPI that share a run of LAMMPS, or threads of the rigid engine.

    Example: percussions run arch --engine yade --stiffness 1e7"""
    from analysis.engines.rigid import NAME as RIGID
    from analysis.engines.rigid import TOLERANCE
    from analysis.engines.run import EngineRun
    from analysis.scene.scene import read_scene
    from analysis.scene.unused import note_unused_keys

    chosen = read_scene(scene)
    if error is not None and (stiffness, law, time_step) != (None, None, None):
        raise ValueError(
            "error: it chooses law, stiffness and time step. "
            "Leave out --law, --stiffness, --time-step"
        )
    for warning in chosen.check(scene):
        app.warn(warning)
    contact = {"stiffness_N_per_m": stiffness, "wall_stiffness_N_per_m": wall_stiffness}
    chosen = chosen.with_contact(**app.drop_none(**contact, restitution=restitution, law=law))
    if engine == RIGID:
        springs = {"stiffness": stiffness, "wall_stiffness": wall_stiffness, "law": law}
        app.refuse("only of engines with springs, lammps and yade", **springs)
    else:
        app.refuse("only of --engine rigid", exact=exact or None)
    step = {"rigid_step_s" if engine == RIGID else "time_step_s": time_step}
    step["rigid_tolerance"] = TOLERANCE if exact else None
    timing = app.drop_none(**step, duration_s=duration, impulses=impulses or None)
    chosen = chosen.with_run(**timing)
    if error is not None:
        from analysis.studies.advice.choice import scene_within

        chosen, engine, choice = scene_within(chosen, error, engine)
        print(f"advised: {choice}")
    wanted = replace(EngineRun.of(chosen, engine or "lammps", out), ranks=ranks)
    note_unused_keys(scene, wanted.engine)
    expected = functools.partial(app.say_expected, what=f"{chosen.name} with {wanted.engine}")
    with app.progress() as report:
        record = wanted.record(report, expected)
    got, requested = record.restitution_most, wanted.scene.contact.restitution
    as_asked = "as asked" if f"{got:.3g}" == f"{requested:.3g}" else f"{requested:.3g} was asked"
    print(
        f"{wanted.folder}: {record.steps} steps of {record.time_step_s:.3g} s, restitution "
        f"{got:.3g}, {as_asked}, {record.cpu_seconds:.2f} CPU s"
    )


def solve(
    dump: list[Path],
    *,
    dump_options: DumpOptions,
    contacts: InputFile | None = None,
    contacts_columns: str | None = None,
    contacts_factor: Factor | None = None,
    restitution: Share | None = None,
    openness: Indeterminacy = "determined",
    workers: Processes = 1,
    threads: Count = 1,
    scheduler: str | None = None,
    part_frames: Count | None = None,
    out: Out = Path("contacts.csv"),
) -> None:
    """Compute the percussions at every contact of every frame of a dump, or of an FCLIB problem.

    Exit status 0 only if every frame is solved.

    dump: LAMMPS dump, text or binary, plain or gz, bz2, xz, zst. It needs id, a position (x y, xu yu
        or xs ys), radius, and mass or density. Or an FCLIB file (HDF5), which has its own
        contacts.
    contacts: Contacts that came with the dump, taken in place of those within --contact-tolerance: a dump
        local, a table (CSV, Parquet), or exaDEM's folder. Their forces stand beside the percussions.
    restitution: Restitution of the contacts. Default: the room's in an impact, else inelastic.
    workers: Cores that work on it.
    threads: Threads for each frame of 10,000 disks or more.
    part_frames: Write a folder of Parquet files, each of so many frames, and keep those that are
        there: what was interrupted goes on.

    out: Table, one row per contact: CSV, or Parquet if it ends in .parquet.

    Example: percussions solve out/arch/lammps_hooke_k1e+06/bodies.dump --left-velocity desired
    --out contacts.csv"""
    from analysis.percussions.contact_rows import is_parquet
    from analysis.percussions.setting import room_beside
    from analysis.percussions.solve_dump import DumpToSolve, solve_dump, solve_in_chunks
    from analysis.studies.exchange.problem import is_hdf5

    file = one_dump(dump)
    if out.is_file() and any(
        out.samefile(one) for one in (file, dump_options.room, contacts) if one and one.exists()
    ):
        raise ValueError(f"--out: {out}: the table would replace what it is made of")
    options = dump_options.setting()
    if is_hdf5(file):
        own = {**options, "room": dump_options.room, "restitution": restitution, "scheduler": scheduler}
        own |= dump_options.of_dump() | {"part_frames": part_frames, "contacts": contacts}
        app.refuse(f"{file} has its own. This option is for dumps", **own)
        _solve_problem(file, out, dump_options.tolerance, openness)
        return
    if contacts is None:
        app.refuse("of --contacts, which is not given", contacts_columns=contacts_columns, contacts_factor=contacts_factor)
    room, setting = room_beside(file, dump_options.room, dump_options.of_dump(), **options)
    job = DumpToSolve(
        path=file,
        **dump_options.of_dump(),
        setting=setting,
        law=None if restitution is None else replace(setting.law, restitution=restitution),
        tolerance=dump_options.tolerance,
        indeterminacy=openness,
        threads=threads,
    )
    if contacts:
        job = _listed(job, room, contacts, contacts_columns, contacts_factor)
    if part_frames and not is_parquet(out):
        raise ValueError(f"--part-frames: {out}: parts are Parquet. End --out in .parquet")
    with app.progress() as bars:
        how: dict[str, Any] = {"workers": workers, "scheduler": scheduler, "progress": bars}
        if part_frames:
            found = solve_in_chunks(job, out, part_frames, **how)
        else:
            expected = functools.partial(app.say_expected, what=f"percussions of {file}")
            found = solve_dump(job, out, expected=expected, **how)
    rows = _rows(found, bool(dump_options.fixed_type), bool(contacts))
    _say(file, out, rows, found.unsolved)


def _listed(
    job: DumpToSolve, room: Room | None, contacts: Path, columns: str | None, factor: float | None
) -> DumpToSolve:
    """The job with the contacts that came with its dump."""
    from analysis.studies.film.files import listed_contacts

    setting = job.setting.of_dump(trajectory := job.trajectory)
    return replace(job, setting=setting, listed_contacts=listed_contacts(trajectory, contacts, room, setting, columns, factor))


def _rows(found: SolvedDump, fixed: bool, listed: bool) -> list[list[str]]:
    """What is said of a solved dump."""
    rows = [["frames", str(found.frames)], ["contacts", str(found.contacts)]]
    what = "largest contact " + ("force" if found.unit == "N" else "percussion")
    rows += [[what, f"{found.largest:.4g} {found.unit} at {found.when}"]]
    if fixed:
        rows += [["largest sum on fixed disks", f"{found.standing:.4g} {found.unit}"]]
    if listed:
        rows += [["listed, not touching", str(found.apart)], ["touching, not listed", str(found.missing)]]
    return [*rows, ["worst residual", f"{found.residual:.1e}"]]


def _solve_problem(problem: Path, out: Path, tolerance: float, indeterminacy: Indeterminacy) -> None:
    from analysis.percussions.contact_rows import is_parquet
    from analysis.studies.exchange.fclib import solve_file

    if is_parquet(out):
        raise ValueError(f"--out: {out}: Parquet is for dumps. The table of a problem is CSV")
    found = solve_file(problem, out, tolerance, indeterminacy)
    rows = [["contacts", str(found.contacts)], ["residual", f"{found.residual:.1e}"]]
    if found.difference is not None:
        rows.append(["largest difference of u from /solution", f"{found.difference:.1e}"])
    _say(problem, out, rows, [f"{problem}: {found.why}"] if found.why else [])


def _say(solved: Path, out: Path, rows: list[list[str]], unsolved: Sequence[str]) -> None:
    """Print numbers, where the table is and what is not solved, which is the exit status."""
    for line in unsolved:
        print(line, file=sys.stderr)
    app.show([str(solved), ""], rows)
    print(out)
    if unsolved:
        raise typer.Exit(1)


def export(
    target: Path,
    *,
    fclib: Out,
    dump_options: DumpOptions,
    frame: int | None = None,
    local: bool = False,
    openness: Indeterminacy = "ranges",
) -> None:
    """Write the contact problem of one instant as an FCLIB file, with its answer.

    Global form, in the plane. Contacts are inelastic, with friction. The groups /crowd (bodies,
    walls, units, dt, origin) and /truth (rank, determined, intervals) are beside FCLIB's own.
    `percussions solve FILE` reads it back.

    Exit status 1 if the problem is not solved. It is then written without a solution.

    target: Folder of a run, a LAMMPS dump, or a scene (its name or .toml file).
    fclib: HDF5 file to write.
    frame: Of a run or dump: its number from 0, or from the end: -1. Default: the last.
    local: Write FCLIB's local form W r + q too.

    Example: percussions export out/gate/lammps_hooke_k1e+06 --fclib gate.hdf5"""
    from analysis.studies.exchange.fclib import write_problem

    dump = target / "bodies.dump" if target.is_dir() else target
    if dump.is_file() and dump.suffix != ".toml":
        if fclib.exists() and fclib.samefile(dump):
            raise ValueError(f"--fclib: {fclib}: it would replace what it is made of")
        found, origin = _of_dump(dump, frame, dump_options)
    elif target.is_dir():
        raise ValueError(f"{dump}: no such file, so {target} is no folder of a run")
    else:
        why = f"only of a run or a dump, and {target} is a scene"
        app.refuse(why, frame=frame, room=dump_options.room, **dump_options.of_dump())
        found, origin = _of_scene(target, dump_options)
    write_problem(
        fclib, found, origin | {"command": app.command_line()}, local=local, indeterminacy=openness
    )
    print(f"{len(found.snapshot)} people, {len(found.contacts)} contacts")
    print(fclib)
    solved = found.solution.status == "solved"
    if not solved:
        print(f"{fclib}: {found.solution.status}: {found.solution.reason}", file=sys.stderr)
    raise typer.Exit(not solved)


def _of_dump(
    dump: Path, frame: int | None, dump_options: DumpOptions
) -> tuple[SnapshotPercussions, dict[str, str]]:
    """The percussions of a frame, and where it is from."""
    from analysis.dumps import open_bodies
    from analysis.percussions.setting import setting_beside
    from analysis.percussions.snapshot import percussions_of_frames

    setting = _inelastic(dump, setting_beside(dump, dump_options.room, dump_options.of_dump(), **dump_options.setting()))
    trajectory = open_bodies(dump, **dump_options.of_dump()).trajectory
    number, count = -1 if frame is None else frame, len(trajectory)
    if not -count <= number < count:
        raise ValueError(f"--frame: {number} where {dump} has {count}, from 0")
    setting, numbers = setting.of_dump(trajectory), [number % count]
    _, found = next(percussions_of_frames(trajectory, numbers, setting, tolerance=dump_options.tolerance))
    return found, {"source": str(dump), "step": str(int(trajectory.ts.data["step"]))}


def _inelastic(target: Path, setting: Setting) -> Setting:
    """The setting without restitution, which is said where there was one."""
    if bouncing := setting.law.restitution:
        message = f"contact.restitution: {bouncing:g}"
        app.warn(f"{target}: {message}. FCLIB has inelastic contacts, and those are written")
    return replace(setting, restitution=0.0)


def _of_scene(target: Path, dump_options: DumpOptions) -> tuple[SnapshotPercussions, dict[str, str]]:
    """The percussions of a scene's initial state, and where it is from."""
    from analysis.percussions import Setting, percussions_of
    from analysis.scene import read_scene
    from analysis.scene.unused import note_unused_keys

    scene = read_scene(target)
    setting = _inelastic(target, replace(Setting.of(scene), **dump_options.setting()))
    note_unused_keys(target, f"left velocity {setting.kind}")
    found = percussions_of(setting, scene.snapshot, tolerance=dump_options.tolerance)
    origin = {"source": scene.title, "scene": scene.name, "scene_sha256": scene.digest()}
    return found, origin


def doctor() -> None:
    """List the engines and the libraries of each part, and what to do about a missing one.

    Example: percussions doctor"""
    from analysis.engines.doctor import examine

    findings = examine()
    head = ["what", "part", "state", "version", "where"]
    rows = [(one.name, one.extra, one.state, one.version, one.path) for one in findings]
    app.show(head, [[str(cell or "–") for cell in row] for row in rows], numbers_from=5)
    for finding in findings:
        if finding.advice:
            print(f"{finding.name}: {finding.advice}")
    raise typer.Exit(any(finding.state == "missing" for finding in findings))
