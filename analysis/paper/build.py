"""The sections of the paper's pages: which there are, what each needs, and how they are built."""

import base64
import functools
import hashlib
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from importlib import metadata
from pathlib import Path

import analysis
import nscd
from analysis.engines.run import Cost, EngineRun, run_ahead
from analysis.pages.html import drawn
from analysis.pages.section import Claim, Drawn, Section, Table, Verdict
from analysis.paper.continuum import bridge, solid_chain
from analysis.paper.continuum import fig7_border as fig7
from analysis.paper.continuum import fig8_turbulence as fig8
from analysis.paper.continuum import fig9_exit_pressure as fig9
from analysis.paper.continuum import fig10_density as fig10
from analysis.paper.continuum import fig11_left_velocities as fig11
from analysis.paper.continuum import mesh_precision as mesh
from analysis.paper.discrete import fig1_four_disks, fig3_chains, fig4_arch, fig5_masses
from analysis.paper.discrete import fig2_corridor as fig2
from analysis.paper.discrete import fig6_rivals as fig6
from analysis.support import cache
from analysis.support.parallel import Task, do_all, workers
from analysis.support.progress import Progress

# What the numbers of a kept section depend on, beside the sources.
LIBRARIES = ("numpy", "scipy", "scikit-fem", "netgen-mesher", "matplotlib")


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A figure of the paper, or a study beside the figures.

    number: 8, 3.2.1, or a word
    seconds: CPU seconds that building takes, about
    build: its section
    engine_runs: the runs that it needs, for the folder that keeps runs; None: it needs no engine
    """

    number: str
    seconds: float
    build: Callable[[Path, Progress | None], Section]
    engine_runs: Callable[[Path], list[EngineRun]] | None = None


def _alone(build: Callable[[Progress | None], Section]) -> Callable[..., Section]:
    return lambda runs, progress: build(progress)


DISCRETE: Sequence[Part] = (
    Part(
        number="1", seconds=2, build=fig1_four_disks.build, engine_runs=fig1_four_disks.engine_runs
    ),
    Part(number="2", seconds=8, build=fig2.build, engine_runs=fig2.engine_runs),
    Part(number="3", seconds=2, build=_alone(fig3_chains.build)),
    Part(number="4", seconds=12, build=fig4_arch.build, engine_runs=fig4_arch.engine_runs),
    Part(number="5", seconds=3, build=fig5_masses.build, engine_runs=fig5_masses.engine_runs),
    Part(number="6", seconds=40, build=fig6.build, engine_runs=fig6.engine_runs),
)
CONTINUUM: Sequence[Part] = (
    Part(number="7", seconds=8, build=_alone(fig7.build)),
    Part(number="3.2.1", seconds=2, build=_alone(solid_chain.build)),
    Part(number="8", seconds=70, build=_alone(fig8.build)),
    Part(number="9", seconds=10, build=_alone(fig9.build)),
    Part(number="10", seconds=20, build=_alone(fig10.build)),
    Part(number="11", seconds=6, build=_alone(fig11.build)),
    Part(number="mesh", seconds=30, build=_alone(mesh.build)),
    Part(number="bridge", seconds=110, build=_alone(bridge.build)),
)
LABELS = {"mesh": "Speed and accuracy", "bridge": "From contacts to stress"}


def label(number: str) -> str:
    """Name a section: Fig. 8, Section 3.2.1, or the study beside the figures."""
    return f"Fig. {number}" if number.isdigit() else LABELS.get(number, f"Section {number}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Built:
    """A section and what it cost.

    cpu_seconds: s, in Python
    engines: the engine runs made for it first; a run of several sections counts for the first
    kept: whether an earlier build made it
    """

    section: Section
    cpu_seconds: float
    engines: Cost = field(default_factory=Cost)
    kept: bool = False

    @property
    def total_seconds(self) -> float:
        """CPU seconds of Python and the engines."""
        return self.cpu_seconds + self.engines.cpu_seconds

    @property
    def label(self) -> str:
        """Fig. 8, Section 3.2.1, or the name of a study beside the figures."""
        return label(self.section.number)

    @property
    def anchor(self) -> str:
        """What links on the page lead to."""
        return f"fig-{self.section.number.replace('.', '-')}"


def build(
    parts: Sequence[Part],
    runs: Path,
    figures: Iterable[str] | None = None,
    progress: Progress | None = None,
) -> list[Built]:
    """Build the chosen sections (all by default), on as many cores as there are.

    Engine runs come first, and unchanged ones are taken from `runs`, as are sections without engine
    runs that the same product has built. Raises ValueError for a figure that no part has."""
    known = [part.number for part in parts]
    wanted = list(known if figures is None else figures)
    for number in wanted:
        if number not in known:
            raise ValueError(f"figure: {number}; this part of the paper has {', '.join(known)}")
    parts = [part for part in parts if part.number in wanted]
    needed = {part.number: part.engine_runs(runs) for part in parts if part.engine_runs}
    costs = run_ahead([run for chosen in needed.values() for run in chosen], progress)
    built = {
        part.number: found
        for part in parts
        if not part.engine_runs and (found := kept(folder_of(runs, part)))
    }
    missing = [part for part in parts if part.number not in built]
    if len(missing) == 1:
        new = [_make(missing[0].number, runs, progress)]
    elif missing:
        tasks = [
            Task(call=_make, arguments=(part.number, runs), work=part.seconds) for part in missing
        ]
        with workers() as executor:
            new = do_all(tasks, executor, "sections", progress)
    else:
        new = []
    for part, made in zip(missing, new, strict=True):
        mine = [costs.pop(run.folder, Cost()) for run in needed.get(part.number, [])]
        built[part.number] = replace(made, engines=sum(mine, Cost()))
    return [built[part.number] for part in parts]


def _make(number: str, runs: Path, progress: Progress | None = None) -> Built:
    """Build and draw a section; in a process of its own it has nobody to tell its progress to."""
    part = next(part for part in (*DISCRETE, *CONTINUUM) if part.number == number)
    made_by, started = edition(), time.process_time()
    section = part.build(runs, progress)
    section = replace(section, pictures=[drawn(picture) for picture in section.pictures])
    built = Built(section=section, cpu_seconds=time.process_time() - started)
    if not part.engine_runs:
        keep(built, folder_of(runs, part), made_by)
    return built


def folder_of(runs: Path, part: Part) -> Path:
    """Name the folder that keeps a part's section."""
    return runs / "paper_sections" / part.number


@functools.cache
def edition() -> str:
    """Digest what a section without engines depends on: our sources and words, the libraries."""
    digest = hashlib.sha256(
        " ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES).encode()
    )
    for package in (nscd, analysis):
        root = Path(package.__path__[0])
        for path in sorted([*root.rglob("*.py"), *root.rglob("*.md")]):
            digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()


def keep(built: Built, folder: Path, made_by: str) -> None:
    """Write a drawn section as one JSON file, whole or not at all; made_by: the edition."""
    content = asdict(built.section) | {"cpu_seconds": built.cpu_seconds}
    cache.keep(folder / "section.json", made_by, content)


def kept(folder: Path) -> Built | None:
    """Read the section that this edition of the product has kept; None where there is none."""
    content = cache.kept(folder / "section.json", edition())
    if content is None:
        return None
    try:
        seconds = content.pop("cpu_seconds")
        for picture in content["pictures"]:
            picture |= {kind: base64.b64decode(picture[kind]) for kind in ("png", "pdf")}
        content["pictures"] = [Drawn(**picture) for picture in content["pictures"]]
        content["tables"] = [Table(**table) for table in content["tables"]]
        content["claims"] = [
            Claim(**claim | {"verdict": Verdict(claim["verdict"])}) for claim in content["claims"]
        ]
        return Built(section=Section(**content), cpu_seconds=float(seconds), kept=True)
    except (ValueError, KeyError, TypeError):
        return None
