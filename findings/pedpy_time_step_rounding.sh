#!/usr/bin/env bash
# PedPy 1.5.1, _calculate_frames_and_fps (pedpy/io/helper.py): loaders of crowd:it, Viswalk and Pathfinder.
# One would guess: a file with a row every 0.4 s is read with 2.5 frames per second.
# What happens: the frame rate is rounded to a whole number (2) and the times to frames of that: two rows of one
#   person share a frame, and a steady 1 m/s comes out as 0.8 and 1.6 m/s, 12 % too fast in the mean.
#   With a row every 2 s the rate is 0 and all rows are frame 0.
# Who is hurt: whoever reads times that are no whole fraction of a second: speeds, fundamental diagrams.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import pedpy

def load(step):
    rows = [f"1,{i * step:.2f},{i * step:.2f},1.0" for i in range(41)]  # walks at 1 m/s
    pathlib.Path("c.csv").write_text("\n".join(["pedID,time,posX,posY", *rows]) + "\n")
    return pedpy.load_trajectory_from_crowdit(trajectory_file=pathlib.Path("c.csv"))

def speeds(trajectory):
    return pedpy.compute_individual_speed(traj_data=trajectory, frame_step=1,
                                          speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED).speed
print("PedPy", importlib.metadata.version("pedpy"))
good, bad, slow = load(0.5), load(0.4), load(2.0)
shared = int(bad.data.duplicated(["id", "frame"]).sum())
g, b = speeds(good), speeds(bad)
print(f"every 0.5 s: {good.frame_rate} fps, speed {g.min():.2f} to {g.max():.2f} m/s")
print(f"every 0.4 s: {bad.frame_rate} fps, speed {b.min():.2f} to {b.max():.2f}, mean {b.mean():.2f} m/s, "
      f"{shared} rows share a frame with another")
print(f"every 2 s: {slow.frame_rate} fps, frames {set(slow.data.frame)}")
holds = (good.frame_rate == 2 and abs(g - 1).max() < 1e-9 and bad.frame_rate == 2 and shared == 8
         and abs(b.min() - 0.8) < 1e-9 and abs(b.max() - 1.6) < 1e-9 and b.mean() > 1.1
         and slow.frame_rate == 0 and set(slow.data.frame) == {0})
sys.exit(0 if holds else "the behaviour has changed")
E
