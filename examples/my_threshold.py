"""Who bears more than a limit of mine?

A limit is a line of data with its source. Loads are averages over 0.1 s, from every step of a run."""

from pathlib import Path

from crowd_percussions import known_limits, make, read_exposure, simulate

MINE = """
[[limit]]
name = "mine"
number = 1500.0
unit = "N"
quantity = "contact_largest"
what = "one contact presses with one and a half kilonewtons"
population = "adults"
source = "an example"
read = "first-hand"
"""
Path("limits.toml").write_text(MINE, encoding="utf-8")
(limit,) = (one for one in known_limits([Path("limits.toml")]) if one.name == "mine")

scene = make("arch", disks=40).with_run(duration_s=1.0, frames=10)
simulate(scene, "rigid", Path("pressed"))
exposure = read_exposure(Path("pressed"))
total, longest = exposure.time_above(limit)
above = int((total > 0).sum())
print(f"{above} of {len(total)} people above {limit.number:g} N, for {longest.max():.1f} s at most")
