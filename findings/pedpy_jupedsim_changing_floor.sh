#!/usr/bin/env bash
# JuPedSim 1.4.2 (switch_geometry) read by PedPy 1.5.1 (pedpy/io/jupedsim_loader.py, ped_data_archive_loader.py).
# One would guess: the walkable area of one run does not depend on the format in which the run was written.
# What happens: where a barrier moves during the run, PedPy takes the union of all floors from SQLite (no barrier at
#   all, at any time) and the first floor alone from HDF5. JuPedSim's own Recording.geometry() is the union as well.
# Who is hurt: whoever takes densities or Voronoi cells next to gates and moved barriers: the two files of one run
#   give different areas, and the union is a floor that never was.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1 jupedsim==1.4.2 h5py==3.16.0 shapely==2.2.0
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, pathlib, sys
import jupedsim as jps, pedpy, shapely
from jupedsim.hdf5_serialization import Hdf5TrajectoryWriter
hall = shapely.box(0, 0, 10, 4)
before, after = hall.difference(shapely.box(4, 1, 6, 3)), hall.difference(shapely.box(7, 1, 8, 3))

def run(writer):
    simulation = jps.Simulation(model=jps.CollisionFreeSpeedModel(), geometry=before, trajectory_writer=writer)
    exit_stage = simulation.add_exit_stage([(9, 0), (10, 0), (10, 4), (9, 4)])
    journey = simulation.add_journey(jps.JourneyDescription([exit_stage]))
    simulation.add_agent(jps.CollisionFreeSpeedModelAgentParameters(position=(1, 2), journey_id=journey,
                                                                    stage_id=exit_stage))
    simulation.iterate(40)
    simulation.switch_geometry(after)
    simulation.iterate(40)
    writer.close()

sqlite, hdf5 = pathlib.Path("run.sqlite"), pathlib.Path("run.h5")
run(jps.SqliteTrajectoryWriter(output_file=sqlite))
run(Hdf5TrajectoryWriter(output_file=hdf5))
areas = {"SQLite": pedpy.load_walkable_area_from_jupedsim_sqlite(trajectory_file=sqlite).polygon.area,
         "HDF5": pedpy.load_walkable_area_from_ped_data_archive_hdf5(trajectory_file=hdf5).polygon.area,
         "Recording": jps.Recording(str(sqlite)).geometry().area}
print(*(f"{n} {importlib.metadata.version(n)}" for n in ("jupedsim", "pedpy")))
print(f"floor before: {before.area} m2, after: {after.area} m2; read back: {areas}")
holds = (before.area, after.area) == (36, 38) and areas == {"SQLite": 40, "HDF5": 36, "Recording": 40}
sys.exit(0 if holds else "the behaviour has changed")
E
