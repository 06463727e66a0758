"""How often ranges and verdicts over replicates keep what they promise, on crowds that are known.

    nice -n 19 python benchmarks/crowds/replicates.py FOLDER --draws 400 [--friction 0.4 --crowds 40]

Crowds of `arch` of 150 people are run for 2 s by the rigid engine; runs that are in FOLDER are taken
as they are. Of these crowds 3, 5 and 10 are drawn as the replicates of a report. Its ranges are held
against all other crowds, and its verdicts against as many other crowds of the same model: no
difference is there. Prints the table of docs/results/report.md."""

from pathlib import Path

import numpy as np

from analysis.engines.run import EngineRun
from analysis.scene.shipped_scenes import make
from analysis.studies.exposure.loads import RunLoads, read_exposure
from analysis.studies.motion.inference import Sample, differences
from analysis.studies.motion.study import COMPARED, Model
from benchmarks.machine import head, line, options
from nscd.arrays import Indices

PEOPLE, DURATION_S, LAST_S = 150, 2.0, 1.0
REPLICATES = (3, 5, 10)
# A true difference, whose verdicts are counted too.
MORE = 1.1
# Of the ranges: those of windows, without shares and lifetimes of arches, and the flow.
WINDOWS = [key for key in COMPARED if key != "flow" and not key.startswith("arch")]


def series_of(folder: Path, crowds: int, friction: float) -> list[RunLoads]:
    """Run the crowds that are not there, and read all."""
    found = []
    for seed in range(1, crowds + 1):
        scene = make("arch", PEOPLE, seed).with_contact(friction=friction)
        scene = scene.with_run(duration_s=DURATION_S, frames=20, impulses=True)
        run = EngineRun(scene=scene, engine="rigid", folder=folder / f"{friction:g}_{seed}")
        run.record()
        found.append(read_exposure(run.folder))
    return found


def ensemble(series: list[RunLoads], chosen: Indices) -> Model:
    """The model of some of the crowds."""
    some = [series[index] for index in chosen]
    return Model(title="rigid", series=some, last_s=LAST_S)


def samples(of: Model, more: float = 1.0) -> dict[str, Sample]:
    """All quantities of a model, its forces that much larger."""
    found = {key: of.sample(key) for key in COMPARED if key != "arch_lifetime"}
    for key in WINDOWS:
        one = found[key]
        found[key] = Sample(values=more * one.values, noise=more**2 * one.noise)
    return found


def measured(series: list[RunLoads], count: int, draws: int) -> list[str]:
    """One row: how many replicates, what ranges hold, what verdicts say."""
    random = np.random.default_rng(count)
    collected: dict[str, list[float]] = {key: [] for key in (*WINDOWS, "flow")}
    wrong, observed = 0, {key: 0 for key in WINDOWS}
    for _ in range(draws):
        order = random.permutation(len(series))
        mine, theirs, rest = np.split(order, [count, 2 * count])
        model, further = ensemble(series, mine), ensemble(series, np.concatenate([theirs, rest]))
        for key, fractions in collected.items():
            found, others = model.interval(key), np.concatenate(further.windows(key))
            fractions.append(float(((others >= found.low) & (others <= found.high)).mean()))
        other = samples(ensemble(series, theirs))
        wrong += any(one.significant for one in differences(samples(model), other).values())
        truly = differences(samples(model, MORE), other)
        for key in WINDOWS:
            observed[key] += truly[key].significant
    fraction = [float(np.mean(collected[key])) for key in WINDOWS]
    shown = "contact_mean", "walls", "contact_95", "contact_largest"
    power = ", ".join(f"{observed[key] / draws:.0%}" for key in shown)
    ranges = f"{min(fraction):.0%} to {max(fraction):.0%}", f"{np.mean(collected['flow']):.0%}"
    return [str(count), *ranges, f"{wrong / draws:.1%}", power]


def main() -> None:
    """Run, draw and print."""
    args = options(__doc__, "folder", crowds=60, draws=300, friction=0.0)
    series = series_of(args.folder, args.crowds, args.friction)
    print(head("replicates", "windows held", "flow held", "any false verdict", "+10 % seen"))
    for count in REPLICATES:
        print(line(measured(series, count, args.draws)), flush=True)


if __name__ == "__main__":
    main()
