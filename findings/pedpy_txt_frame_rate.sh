#!/usr/bin/env bash
# PedPy 1.5.1, load_trajectory_from_txt (pedpy/io/ped_data_archive_loader.py, _load_trajectory_meta_data_from_txt).
# One would guess: "# camera 12 of hall 3, framerate: 25 fps" means 25 frames per second.
# What happens: the frame rate is the first number that stands alone in a comment with "framerate": 12. And
#   "framerate: 25fps" has no such number. With a comment that holds both, "framerate: 25fps, 4 cameras", it is 4.
# Who is hurt: whoever describes the recording in the header: every speed is off by 12/25 or 4/25, silently.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import pedpy
print("PedPy", importlib.metadata.version("pedpy"))
seen = []
for comment in ("framerate: 25 fps", "camera 12 of hall 3, framerate: 25 fps", "framerate: 25fps, 4 cameras"):
    rows = [f"1 {i} {i / 25:.2f} 1.0 1.7" for i in range(50)]  # walks at 1 m/s
    pathlib.Path("t.txt").write_text("\n".join([f"# {comment}", "# id frame x/m y/m z/m", *rows]) + "\n")
    trajectory = pedpy.load_trajectory_from_txt(trajectory_file=pathlib.Path("t.txt"))
    speed = pedpy.compute_individual_speed(traj_data=trajectory, frame_step=5).speed.mean()
    print(f"# {comment}: {trajectory.frame_rate} per second, 1 m/s becomes {speed:.2f} m/s")
    seen.append((trajectory.frame_rate, round(float(speed), 6)))
holds = seen == [(25, 1), (12, 0.48), (4, 0.16)]
sys.exit(0 if holds else "the behaviour has changed")
E
