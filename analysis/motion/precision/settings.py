"""The settings that whole runs are compared at, and their runs: steps and tolerances of the rigid
engine, stiffnesses and steps of those with springs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.engines import ENGINES, PENALTY, engine
from analysis.engines.run import EngineRun, run_folder
from analysis.engines.timing import divided
from analysis.pages.names import engine_name
from analysis.pages.numbers import number, significant
from analysis.scene.scene import Scene
from analysis.scene.variation import variant

RIGID = "rigid"
# Of the rigid engine: steps over its own, tolerances at its own step.
STEPS, TOLERANCES = (0.2, 1.0, 4.0), (1e-4, 1e-2)
# Times the scene's stiffness at the safe step; and, at a step so much longer, the first ones.
STIFFER, LONGER, LONGER_AT = (1.0, 10.0, 100.0), 4.0, 2
# Windows of an impact that is run.
FRAMES_OF_IMPACT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Name an engine with what decides its error.

    step_s: s, of the rigid engine
    tolerance: of its contact problem; None: its own
    stiffness_N_per_m: N/m, of an engine with springs
    longer: its step over the safe one
    """

    engine: str
    step_s: float | None = None
    tolerance: float | None = None
    stiffness_N_per_m: float | None = None  # noqa: N815  (the unit is newton)
    longer: float = 1.0

    @property
    def is_coarse(self) -> bool:
        """Tell whether it is looser than its engine's own: tolerance, or a longer step."""
        return self.tolerance is not None or self.longer != 1

    @property
    def short(self) -> str:
        """Name it beside its engine: `5 ms`, `10⁶ N/m`."""
        if self.step_s is not None:
            last = f", to {significant(self.tolerance)}" if self.tolerance else ""
            return f"{significant(1e3 * self.step_s)} ms{last}"
        last = f", {self.longer:g} × step" if self.longer != 1 else ""
        return f"{number(self.stiffness_N_per_m)} N/m{last}"

    @property
    def title(self) -> str:
        """Name it in full: `LAMMPS, 10⁶ N/m`."""
        return f"{engine_name(self.engine)}, {self.short}"

    def of(self, scene: Scene) -> Scene:
        """Return the scene as it is run."""
        if self.step_s is not None:
            return scene.with_run(rigid_step_s=self.step_s, rigid_tolerance=self.tolerance)
        made = scene.with_contact(stiffness_N_per_m=self.stiffness_N_per_m)
        made = made.with_run(time_step_s=None)
        if self.longer == 1:
            return made
        safe = engine(self.engine).timing(made).safe_time_step
        return made.with_run(time_step_s=divided(made.run, self.longer * safe)[0])

    def run(self, scene: Scene, out: Path) -> EngineRun:
        """Name the run of a scene with this setting in the folder."""
        made = self.of(scene)
        place = out if self.longer == 1 else out / f"step_{self.longer:g}"
        return EngineRun(
            scene=made, engine=self.engine, folder=run_folder(place, made, self.engine)
        )


def settings_of(scene: Scene, engines: Sequence[str]) -> list[Setting]:
    """List the settings of a scene, the reference first: the rigid engine at its shortest step."""
    found = []
    if RIGID in engines:
        own = engine(RIGID).timing(scene).time_step
        steps = [divided(scene.run, share * own)[0] for share in STEPS]
        found += [Setting(engine=RIGID, step_s=step) for step in dict.fromkeys(steps)]
        found += [Setting(engine=RIGID, step_s=own, tolerance=one) for one in TOLERANCES]
    k = scene.contact.stiffness_N_per_m
    for place, name in enumerate(known.NAME for known in PENALTY if known.NAME in engines):
        found += [
            Setting(engine=name, stiffness_N_per_m=times * k) for times in STIFFER[: 3 - 2 * place]
        ]
        longer = STIFFER[: 0 if place else LONGER_AT]
        found += [
            Setting(engine=name, stiffness_N_per_m=times * k, longer=LONGER) for times in longer
        ]
    return found


def crowds_of(scene: Scene, count: int) -> list[Scene]:
    """Make the crowds of a scene, as they are run by every setting: with impulses, an impact in
    few frames."""
    changes: dict[str, object] = {"impulses": True, "time_step_s": None}
    if scene.drive is None:
        changes["frames"] = FRAMES_OF_IMPACT
    return [variant(scene, index).with_run(**changes) for index in range(count)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SettingRuns:
    """Hold the runs of one setting.

    crowds: by their numbers, with impulses
    alone: crowd 0 without: what the engine's own work costs; None where impulses cost nothing
    """

    setting: Setting
    crowds: Mapping[int, EngineRun]
    alone: EngineRun | None

    @property
    def every(self) -> list[EngineRun]:
        """List all runs."""
        return [*self.crowds.values(), *([self.alone] if self.alone else [])]


def runs_of(settings: Sequence[Setting], crowds: Sequence[Scene], out: Path) -> list[SettingRuns]:
    """Name the runs of crowds by settings: OUT/crowd_0/…, and alone OUT/…."""
    plain = crowds[0].with_run(impulses=None)
    return [
        SettingRuns(
            setting=one,
            crowds={
                index: one.run(crowd, out / f"crowd_{index}") for index, crowd in enumerate(crowds)
            },
            alone=None if one.engine == RIGID else one.run(plain, out),
        )
        for one in settings
    ]


def whole_runs_of(scene: Scene, count: int, out: Path) -> list[SettingRuns]:
    """Name the runs of so many crowds by all engines that are there; none of no crowds."""
    if not count:
        return []
    engines = [known.NAME for known in ENGINES if known.find()]
    crowds = crowds_of(scene, count)
    return runs_of(settings_of(crowds[0], engines), crowds, out)
