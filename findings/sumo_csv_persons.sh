#!/usr/bin/env bash
# SUMO (eclipse-sumo 1.28.0), --fcd-output with a name that ends in .csv (src/microsim/output/MSFCDExport.cpp).
# One would guess: persons come in columns of their own (person_id, person_x, ...), as their XML has <person>
#   elements beside <vehicle>; a column vehicle_id holds vehicles.
# What happens: persons are rows of vehicle_id, vehicle_x, vehicle_y among the cars. With --fcd-output.attributes
#   x,y,speed nothing in a row says which it is: the cars of a street count as pedestrians, or the reverse.
# Who is hurt: whoever counts or takes speeds and densities of pedestrians next to traffic from the CSV.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check eclipse-sumo==1.28.0
cd "$t"
bin="$t/v/bin"
SUMO_HOME=$("$bin/python" -c 'import sumo; print(sumo.SUMO_HOME)'); export SUMO_HOME
echo '<nodes><node id="a" x="0" y="0"/><node id="b" x="100" y="0"/></nodes>' > n.nod.xml
echo '<edges><edge id="ab" from="a" to="b" numLanes="1" speed="14" sidewalkWidth="3"/></edges>' > n.edg.xml
cat > r.rou.xml <<'E'
<routes><vType id="car" vClass="passenger"/><route id="r" edges="ab"/>
<vehicle id="7" type="car" route="r" depart="0"/><person id="8" depart="0"><walk edges="ab"/></person></routes>
E
"$bin/netconvert" -n n.nod.xml -e n.edg.xml -o n.net.xml > netconvert.txt
for out in f.xml f.csv; do
  "$bin/sumo" -n n.net.xml -r r.rou.xml --fcd-output $out --fcd-output.attributes x,y,speed --end 4 --no-step-log > sumo.txt
done
"$bin/python" - <<'E'
import csv, importlib.metadata, sys, xml.etree.ElementTree as ET
xml = {e.get("id"): e.tag for e in ET.parse("f.xml").iter() if e.tag in ("vehicle", "person")}
with open("f.csv") as file:
    rows = list(csv.DictReader(file, delimiter=";"))
print("eclipse-sumo", importlib.metadata.version("eclipse-sumo"))
print("XML:", xml)
print("CSV, columns:", list(rows[0]), "vehicle_id:", sorted({r["vehicle_id"] for r in rows}))
holds = (xml == {"7": "vehicle", "8": "person"} and {r["vehicle_id"] for r in rows} == {"7", "8"}
         and sorted(rows[0]) == ["timestep_time", "vehicle_id", "vehicle_speed", "vehicle_x", "vehicle_y"])
sys.exit(0 if holds else "the behaviour has changed")
E
