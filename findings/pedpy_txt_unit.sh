#!/usr/bin/env bash
# PedPy 1.5.1, load_trajectory_from_txt (pedpy/io/ped_data_archive_loader.py, _load_trajectory_meta_data_from_txt).
# One would guess: a header "x/mm y/mm" is read as millimetres, or refused as a unit that PedPy does not know.
# What happens: it looks for the letters "x/m" and "in m", also as the start of longer words, and the last comment
#   wins: millimetres are taken for metres (1 m/s becomes 1,000), and so are the centimetres of "x/cm y/cm" where a
#   later comment says "recorded in May" (100 m/s).
# Who is hurt: whoever reads motion capture in mm, or archive files with a word of description after the columns.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import pedpy
print("PedPy", importlib.metadata.version("pedpy"))
seen = []
for header, per_metre in (("# id frame x/cm y/cm z/cm", 100), ("# id frame x/mm y/mm z/mm", 1000),
                          ("# id frame x/cm y/cm z/cm\n# recorded in May", 100)):
    rows = [f"1 {i} {i * per_metre // 25} {per_metre} 0" for i in range(50)]  # walks at 1 m/s
    pathlib.Path("t.txt").write_text("\n".join(["# framerate: 25 fps", header, *rows]) + "\n")
    trajectory = pedpy.load_trajectory_from_txt(trajectory_file=pathlib.Path("t.txt"))
    speed = pedpy.compute_individual_speed(traj_data=trajectory, frame_step=5).speed.mean()
    print(f"{header!r}: 1 m/s becomes {speed:g} m/s")
    seen.append(round(float(speed), 6))
holds = seen == [1, 1000, 100]
sys.exit(0 if holds else "the behaviour has changed")
E
