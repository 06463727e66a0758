#!/usr/bin/env bash
# PedPy 1.5.1, load_trajectory_from_vadere (pedpy/io/vadere_loader.py): endTime, endX and endY are not used.
# One would guess: a footstep of Vadere is a movement from its start to its end, and between steps one stands.
# What happens: positions are drawn straight from start to start. (a) The last step of everybody is missing: who
#   walks to x = 1.5 m ends at 1.0. (b) Who takes one step and then waits 9.5 s creeps for 10 s at 0.05 m/s and
#   never stands. (c) One person with a single step makes the file unreadable: ValueError of an empty max(), also
#   with ignore_too_short_trajectories=True.
# Who is hurt: whoever measures stop-and-go, waiting times or the flow over a line just before a target.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1
cd "$t"
head='pedestrianId simTime endTime-PID1 startX-PID1 startY-PID1 endX-PID1 endY-PID1'
printf '%s\n' "$head" '1 0.0 0.5 0.0 1.0 0.5 1.0' '1 0.5 1.0 0.5 1.0 1.0 1.0' '1 1.0 1.5 1.0 1.0 1.5 1.0' \
  '2 0.0 0.5 0.0 3.0 0.5 3.0' '2 10.0 10.5 0.5 3.0 1.0 3.0' > v.traj
printf '%s\n' "$head" '1 0.0 0.5 0.0 1.0 0.5 1.0' '1 0.5 1.0 0.5 1.0 1.0 1.0' '3 0.0 0.5 0.0 3.0 0.5 3.0' > single.traj
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import pedpy
trajectory = pedpy.load_trajectory_from_vadere(trajectory_file=pathlib.Path("v.traj"), frame_rate=10)
walker, waiter = (trajectory.data[trajectory.data.id == p].set_index("frame").x for p in (1, 2))
speed = waiter.diff().dropna() * 10
print("PedPy", importlib.metadata.version("pedpy"))
print(f"(a) the walker to x = 1.5 m is last seen at {walker.iloc[-1]:.2f} m, {walker.index[-1] / 10} s")
print(f"(b) who stands at 0.5 m from 0.5 to 10 s is at {waiter[50]:.2f} m after 5 s, "
      f"speed {speed.min():.3f} to {speed.max():.3f} m/s")
try:
    pedpy.load_trajectory_from_vadere(trajectory_file=pathlib.Path("single.traj"), frame_rate=10,
                                      ignore_too_short_trajectories=True)
    error = ""
except ValueError as refused:
    error = str(refused)
print("(c) one step of 0.5 s:", error)
holds = (abs(walker.iloc[-1] - 1.0) < 1e-9 and walker.index[-1] == 10 and abs(waiter[50] - 0.25) < 1e-9
         and abs(speed - 0.05).max() < 1e-9 and "empty" in error)
sys.exit(0 if holds else "the behaviour has changed")
E
