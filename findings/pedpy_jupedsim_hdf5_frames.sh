#!/usr/bin/env bash
# JuPedSim 1.4.2 (Hdf5TrajectoryWriter, jupedsim/hdf5_serialization.py: frame is "<u4") read by PedPy 1.5.1.
# One would guess: the HDF5 file and the SQLite file of one run give PedPy the same results.
# What happens: PedPy subtracts frames (pedpy/methods/method_utils.py); those of HDF5 are unsigned, and negative
#   differences become 2^32 - n. (a) compute_time_distance_line keeps the rows after the crossing, some 1e8 s
#   from the line, which it drops for SQLite. (b) BORDER_ADAPTIVE speeds miss the last frames of every track.
# Who is hurt: whoever takes the HDF5 writer: time-distance plots are useless, speeds at the exit are gone.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1 jupedsim==1.4.2 h5py==3.16.0
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import jupedsim as jps, pedpy
from jupedsim.hdf5_serialization import Hdf5TrajectoryWriter

def run(writer):
    simulation = jps.Simulation(model=jps.CollisionFreeSpeedModel(), geometry=[(0, 0), (10, 0), (10, 4), (0, 4)],
                                dt=0.01, trajectory_writer=writer)
    exit_stage = simulation.add_exit_stage([(9, 0), (10, 0), (10, 4), (9, 4)])
    journey = simulation.add_journey(jps.JourneyDescription([exit_stage]))
    simulation.add_agent(jps.CollisionFreeSpeedModelAgentParameters(position=(1, 2), journey_id=journey,
                                                                    stage_id=exit_stage))
    simulation.iterate(400)
    writer.close()

print(*(f"{n} {importlib.metadata.version(n)}" for n in ("jupedsim", "pedpy")))
seen = {}
for name, writer, load in (
        ("run.sqlite", jps.SqliteTrajectoryWriter, pedpy.load_trajectory_from_jupedsim_sqlite),
        ("run.h5", Hdf5TrajectoryWriter, pedpy.load_trajectory_from_ped_data_archive_hdf5)):
    file = pathlib.Path(name)
    run(writer(output_file=file, every_nth_frame=4))
    trajectory = load(trajectory_file=file)
    line = pedpy.MeasurementLine([(3.05, 0), (3.05, 4)])
    latest = pedpy.compute_time_distance_line(traj_data=trajectory, measurement_line=line)["time"].max()
    speed = pedpy.compute_individual_speed(traj_data=trajectory, frame_step=5,
                                           speed_calculation=pedpy.SpeedCalculation.BORDER_ADAPTIVE)
    seen[name] = latest, int(speed["frame"].max()), int(trajectory.data["frame"].max())
    print(f"{name}: {trajectory.data['frame'].dtype}, longest time to the line {latest:.2f} s, "
          f"last speed at frame {seen[name][1]} of {seen[name][2]}")
holds = (seen["run.sqlite"][0] < 4 and seen["run.h5"][0] > 1e8 and seen["run.sqlite"][2] == seen["run.h5"][2]
         and seen["run.sqlite"][1] == seen["run.sqlite"][2] - 1 and seen["run.h5"][1] == seen["run.h5"][2] - 5)
sys.exit(0 if holds else "the behaviour has changed")
E
