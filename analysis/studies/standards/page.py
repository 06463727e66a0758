"""The page of the tests, and the same as CSV and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from analysis.dumps import index_dump
from analysis.engines import EngineError, engine
from analysis.engines.run import EngineRun, check_before, run_ahead
from analysis.pages.drawing import COLOURS, draw_disks, draw_walls, frame, panels
from analysis.pages.html import write_html
from analysis.pages.section import Picture, Section
from analysis.pages.words import Words
from analysis.studies.standards.cases import (
    CASES,
    TIME_GAP_S,
    Case,
    How,
    Judged,
    Track,
    judged_together,
)
from analysis.support.columns import Columns
from analysis.support.files import write_json, write_rows
from analysis.support.parallel import Progress

COLUMNS = Columns("standards")
FAILED = "**fail**"
SEEDS = (1, 2, 4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tested:
    """Hold a test that was run: the tracks of its first seed, and the judgement of all; there are no
    tracks, and `error` says why, where a run failed."""

    case: Case
    tracks: Sequence[Track]
    judged: Judged
    error: str = ""

    @property
    def result(self) -> str:
        """Say pass or fail."""
        return "pass" if self.judged.passed else "fail"

    @property
    def words(self) -> dict[str, str]:
        """Give its title, tests, what it asks, and what was found."""
        words = Words("analysis.studies.standards.cases")
        if not self.error:
            return words.parts(self.case.name, **self.judged.numbers)
        words.blocks[self.case.name] = words.blocks[self.case.name].split("- found:")[0]
        return words.parts(self.case.name) | {"found": self.error}

    @property
    def called(self) -> list[str]:
        """Give what the three standards call it."""
        return self.words["tests"].split(" | ")


def choose(names: Sequence[str] | None) -> list[Case]:
    """Give the tests of these names, or all. Raises ValueError for an unknown name."""
    for name in names or ():
        if name not in CASES:
            raise ValueError(f"case: unknown {name!r}. There are: {', '.join(CASES)}")
    return [case for name, case in CASES.items() if not names or name in names]


def run_tests(
    cases: Sequence[Case],
    engine_name: str,
    out: Path,
    progress: Progress | None = None,
    processes: int | None = None,
    time_gap_s: float = TIME_GAP_S,
) -> list[Tested]:
    """Run the scenes of all tests with each seed and judge them; runs are kept in out/standards.

    Raises EngineError before anything runs for an engine that is missing or refuses a scene."""
    engine(engine_name)
    selected = out / "standards" / f"T{time_gap_s:g}"
    ways = [(How(time_gap_s, seed), selected / f"seed_{seed}") for seed in SEEDS]
    runs = {
        case.name: [
            [EngineRun.of(one, engine_name, at) for one in case.scenes(how)] for how, at in ways
        ]
        for case in cases
    }
    every = [run for seeded in runs.values() for each in seeded for run in each]
    for run in every:
        check_before(run.scene, engine_name, run.folder)
    run_ahead(every, progress, processes)
    return [_tested(case, runs[case.name]) for case in cases]


def _tested(case: Case, runs: Sequence[Sequence[EngineRun]]) -> Tested:
    try:
        tracks = [[_track(run) for run in each] for each in runs]
    except EngineError as error:
        return Tested(case=case, tracks=(), judged=Judged(False, {}), error=str(error))
    judged = judged_together([case.judge(*each) for each in tracks])
    return Tested(case=case, tracks=tracks[0], judged=judged)


def _track(run: EngineRun) -> Track:
    record, index = run.record(), index_dump(run.folder / "bodies.dump")
    columns = [index.columns.index(name) for name in ("id", "x", "y")]
    tables = [index.table(number)[:, columns] for number in range(len(index.steps))]
    position = np.array([rows[np.argsort(rows[:, 0])][:, 1:] for rows in tables])
    time = record.time_step_s * np.array(index.steps)
    return Track(scene=run.scene, time=time, position=position)


def draw(tracks: Sequence[Track]) -> Figure:
    """Draw where the people of each run walked, in the colour of their door, and where they are at
    the end."""
    points = [walls.start for walls in (one.scene.wall_segments() for one in tracks)]
    width, high = np.ptp(np.concatenate(points), axis=0)
    figure, every = panels(7.2, (0.9 + min(6.4 * high / width, 4.0)) * len(tracks), len(tracks))
    for axes, track in zip(every, tracks, strict=True):
        drive, snapshot = track.scene.drive, track.scene.snapshot
        assert drive is not None
        walls = track.scene.wall_segments()
        ends = np.stack([walls.start, walls.end], axis=1)
        doors: dict[Any, str] = {}
        for exit_, mine in drive.exits(snapshot.ids):
            colour = doors.setdefault(exit_.door, COLOURS[len(doors) % len(COLOURS)])
            lines = list(track.position[:, mine].transpose(1, 0, 2))
            axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.5, alpha=0.6))
            axes.plot(*np.transpose(exit_.door), color=colour, lw=3, ls=":")
        draw_disks(axes, replace(snapshot, position=track.position[-1]))
        draw_walls(axes, ends)
        frame(axes, ends.reshape(-1, 2), 0.5)
    return figure


def write_page(tested: Sequence[Tested], engine_name: str, folder: Path, command: str) -> Path:
    """Write standards.html, its figures, standards.csv and standards.json; return the page."""
    words = Words(__package__)
    failed = [one.words["title"].lower() for one in tested if not one.judged.passed]
    passed, title = len(tested) - len(failed), engine(engine_name).TITLE
    lead = words.text("lead", passed=passed, of=len(tested), engine=title, failed=", ".join(failed))
    drives = [track.scene.drive for one in tested for track in one.tracks]
    gaps = [drive.time_gap_s for drive in drives if drive and drive.time_gap_s]
    how = words.items("how", time_gap=(gaps or [TIME_GAP_S])[0], seeds=len(SEEDS))
    rows = [
        [f"[{one.words['title']}](#{one.case.name})", *one.called,
         "pass" if one.judged.passed else FAILED, one.words["found"]]
        for one in tested
    ]  # fmt: skip
    others = [item.split(" | ") for item in words.items("not_applicable")]
    sections = [_section(words, one) for one in tested]
    page = write_html(
        folder / "standards.html",
        "standards.html",
        sections,
        command=command,
        engines=[engine_name],
        first=Section(number="result", title="Result", introduction=[lead]),
        tables=[words.table("summary", rows), words.table("not_applicable_table", others)],
        how=how,
        sections=sections,
    )
    write_rows(folder / "standards.csv", COLUMNS, _rows(tested, others))
    tests = {
        one.case.name: one.words | {"result": one.result, "numbers": one.judged.numbers}
        for one in tested
    }
    reasons = {title: why for title, *_, why in others}
    write_json(folder / "standards.json", {"tests": tests, "not_applicable": reasons})
    return page


def _section(words: Words, one: Tested) -> Section:
    says, several = one.words, len(one.tracks)
    asks = says["asks"][:1].upper() + says["asks"][1:]
    caption = words.text("picture", asks=asks, several=several)
    pictures = [
        Picture(name=one.case.name, caption=caption, figure=draw(shown))
        for shown in [one.tracks[:: max(1, several - 1)]]
        if shown
    ]
    title = f"{says['title']}: {one.result}"
    return Section(number=one.case.name, title=title, words=[says["found"]], pictures=pictures)


def _rows(tested: Sequence[Tested], others: Sequence[Sequence[str]]) -> Iterator[Sequence[Any]]:
    for one in tested:
        lead = (one.case.name, one.words["title"], *one.called, one.result)
        if one.error:
            yield (*lead, "error", one.error)
        for name, value in one.judged.numbers.items():
            for which, ends in value.items() if isinstance(value, dict) else [("", value)]:
                for end, each in zip(("least", "most"), ends, strict=True):
                    yield (*lead, " ".join(filter(None, (name, str(which), end))), each)
    for title, *called, why in others:
        yield "", title, *called, "not applicable", "reason", why
