#!/usr/bin/env bash
# shapely 2.2.0 (from_geojson) into JuPedSim 1.4.2 (geometry_utils.build_geometry) and PedPy 1.5.1 (WalkableArea).
# One would guess: a GeoJSON plan whose features say "floor" and "obstacle" gives a floor with an obstacle in it,
#   or is refused.
# What happens: from_geojson makes a GeometryCollection and forgets the properties; JuPedSim and PedPy both accept
#   it and unite its polygons: the obstacle becomes floor. People are placed in it and walk through it.
# Who is hurt: whoever draws a plan in a GIS, simulates and measures with these: no pillar stands in the crowd.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check pedpy==1.5.1 jupedsim==1.4.2 shapely==2.2.0
cd "$t"
"$t/v/bin/python" - <<'E'
import importlib.metadata, json, sys
import jupedsim as jps, pedpy, shapely
rings = {"floor": [[0, 0], [10, 0], [10, 8], [0, 8], [0, 0]], "obstacle": [[4, 3], [6, 3], [6, 5], [4, 5], [4, 3]]}
plan = shapely.from_geojson(json.dumps({"type": "FeatureCollection", "features": [
    {"type": "Feature", "properties": {"kind": kind}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    for kind, ring in rings.items()]}))
simulation = jps.Simulation(model=jps.CollisionFreeSpeedModel(), geometry=plan)
exit_stage = simulation.add_exit_stage([(9, 0), (10, 0), (10, 8), (9, 8)])
journey = simulation.add_journey(jps.JourneyDescription([exit_stage]))
simulation.add_agent(jps.CollisionFreeSpeedModelAgentParameters(  # in the middle of the obstacle
    position=(5, 4), journey_id=journey, stage_id=exit_stage))
simulation.iterate(100)
simulated = shapely.from_wkt(simulation.get_geometry().as_wkt()).area
measured = pedpy.WalkableArea(plan).polygon.area
walked = next(iter(simulation.agents())).position[0] - 5
print(*(f"{n} {importlib.metadata.version(n)}" for n in ("shapely", "jupedsim", "pedpy")))
print(f"{plan.geom_type}: floor of 80 m2 with an obstacle of 4 m2: {simulated} m2 in JuPedSim, {measured} m2 in PedPy")
print(f"a person put into the obstacle walked {walked:.2f} m in 1 s")
holds = simulated == 80 and measured == 80 and walked > 0.5
sys.exit(0 if holds else "the behaviour has changed")
E
