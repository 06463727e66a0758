"""Does what `percussions infer` says hold? Crowds of its own law, and of two others, in several rooms.

    python -m benchmarks.crowds.inferred [--runs 140] [--others 12]

In each room crowds are drawn from the prior. Each is inferred from all others (leave-one-out): the
share of 90 % intervals that hold the truth, and their widths as a share of the prior's. Then crowds of
other laws: everybody pushes with 30 N for ever; everybody walks at full speed until they touch. How
many are said not to fit, and how many forces are wrong and not said."""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from analysis.infer.crowd import OF_BODIES, Ran, Site, crowd_of, gate_of, simulate, waiting
from analysis.infer.inference import infer, run_prior, uniform
from analysis.infer.tracks import span_of
from analysis.scene.rooms import Crowd, room
from analysis.support.machine import cores
from analysis.support.parallel import Task, do_all, workers
from nscd.arrays import Floats

# Length, width and door (m) of rooms, and how many people leave them.
ROOMS = {"square": (5.0, 4.0, 1.0, 40), "long": (8.0, 3.0, 0.8, 36), "wide": (4.0, 7.0, 1.4, 40)}
MASS_KG, PUSH_N, LASTS_S = 75.0, 30.0, 30.0
SHOWN = ("contact_N", "wall_N", "push_share")


def site_of(name: str) -> Site:
    """A room, its people where they wait, and how long they are watched."""
    length, width, door, people = ROOMS[name]
    made = room(name, length, width, door, Crowd(people=people, radius=0.15))
    gate = gate_of(made, name, np.array([[-1.0, 0.0]]))
    start: Floats = waiting(gate, people, 77)
    return Site(
        room=made, gate=gate, people=people, span=span_of(people), duration_s=LASTS_S, start=start
    )


def other(site: Site, number: int, kind: str) -> Ran | None:
    """A crowd that pushes for ever: with 30 N, or as much as takes it to its speed soon."""
    drawn = crowd_of(uniform(50, number))
    speed, soon = drawn["speed_m_per_s"], drawn["relaxation_time_s"]
    tau = MASS_KG * speed / PUSH_N if kind == "30 N for ever" else soon
    kept = {name: drawn[name] for name in OF_BODIES}
    return simulate(site, kept | {"speed_m_per_s": speed, "relaxation_time_s": tau}, 9000 + number)


def main() -> None:
    """Print a line for each room and law."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=140)
    parser.add_argument("--others", type=int, default=12)
    given = parser.parse_args()
    for name in ROOMS:
        site = site_of(name)
        ran = run_prior(site, given.runs, 1, None, cores())
        own = next(infer(site, one.statistics, ran) for one in ran if one)
        print(f"{name}: " + ", ".join(
            f"{key} in {own.coverage[key]:.2f}, width {own.width[key]:.2f}" for key in SHOWN),
            flush=True)  # fmt: skip
        for kind in ("30 N for ever", "full speed until they touch"):
            with workers(cores()) as pool:
                many = range(given.others)
                tasks = [Task(call=other, arguments=(site, k, kind), work=1.0) for k in many]
                crowds = [one for one in do_all(tasks, pool, "others", None) if one]
            ends: Counter[str] = Counter()
            for one in crowds:
                found = infer(site, one.statistics, ran)
                low, _, high = found.found["contact_N"]
                right = "right" if low <= one.contact_N <= high else "wrong"
                ends["said not to fit" if not found.fits else right] += 1
            print(f"{name}, {kind}: {dict(ends)}", flush=True)


if __name__ == "__main__":
    main()
