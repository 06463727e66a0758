#!/usr/bin/env bash
# Kratos DEM 10.4.4, LOCAL_CONTACT_FORCE of the contact elements (ContactMeshOption; custom_strategies/strategies/
#   explicit_solver_strategy.cpp: SearchDEMOperations, CreateContactElements, PrepareContactElementsForPrinting).
# One would guess: each contact has an element, and a hook as FinalizeSolutionStep reads the force of its step there.
# What happens:
#   1. Elements are made, and set to zero, at the start of a step whose results are printed. They get their value when
#      it is printed, after the hook. So the hook reads 0 N in that step, and the force of the last printed step in all
#      others. A disc of 1 kg presses another by 9.81 N, from 35 ms on by 109.81 N: printed each 10 ms, the hook reads
#      9.81 N until 40 ms, and 0 N at 10, 20, 30, 40 and 50 ms.
#   2. `add_new_bond` is set once for a particle, not for each of its neighbours. Where a first contact takes an
#      element of an earlier print and no other is left, the next contact of the particle takes the same one. A disc
#      that slides from one disc into the gap to another rests on both (5.70 N each), and has one contact in the mesh,
#      printed or not.
# Who is hurt: 1. couplings and controllers that read contact forces in hooks. 2. Force chains, coordination numbers,
#   fabric and stress of the contact mesh, wherever contacts come between two prints.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"
"$t/v/bin/pip" install -q --no-compile --disable-pip-version-check KratosDEMApplication==10.4.4 KratosMultiphysics==10.4.4
cd "$t"
cat > MaterialsDEM.json <<'E'
{"materials": [{"material_name": "disc", "material_id": 1, "Variables":
  {"PARTICLE_DENSITY": 1.2732395447351628, "YOUNG_MODULUS": 1e5, "POISSON_RATIO": 0.0, "COMPUTE_WEAR": false}}],
 "material_relations": [{"material_names_list": ["disc", "disc"], "material_ids_list": [1, 1], "Variables":
  {"DEM_DISCONTINUUM_CONSTITUTIVE_LAW_NAME": "DEM_D_Linear_viscous_Coulomb2D", "COEFFICIENT_OF_RESTITUTION": 0.0,
   "STATIC_FRICTION": 0.0, "DYNAMIC_FRICTION": 0.0, "FRICTION_DECAY": 500.0, "ROLLING_FRICTION": 0.0,
   "ROLLING_FRICTION_WITH_WALLS": 0.0}}],
 "material_assignation_table": [["SpheresPart", "disc"]]}
E
cat > case.py <<'E'
import json
import math
import sys
from importlib.metadata import version
import KratosMultiphysics as Kratos
from KratosMultiphysics.DEMApplication import LOCAL_CONTACT_FORCE
from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage

h = 1e-4


def block(kind, rows):
    return "\n".join([f"Begin {kind}", *(" ".join(map(str, row)) for row in rows), f"End {kind.split()[0]}", ""])


def run(places, until, pulled):
    """Give what a hook and the output read at each step, of discs of which the first is free. pulled: m/s2, at a time."""
    discs, hook, printed = range(1, len(places) + 1), {}, {}
    held = "".join(block(f"NodalData VELOCITY_{axis}", [(k, 1, 0.0) for k in discs[1:]]) for axis in "XY")
    with open("caseDEM.mdpa", "w") as file:
        file.write("Begin Properties 1\nEnd Properties\n" + block("Nodes", [(k, *places[k - 1], 0) for k in discs])
                   + block("Elements CylinderParticle2D", [(k, 1, k) for k in discs])
                   + block("NodalData RADIUS", [(k, 0, 0.5) for k in discs]) + held)
    asked = {"Dimension": 2, "ElementType": "CylinderPartDEMElement2D", "RotationOption": False, "dem_inlet_option": False,
             "NeighbourSearchFrequency": 1, "MaxTimeStep": h, "FinalTime": until - h / 2, "OutputTimeStep": 0.01,
             "ContactMeshOption": True, "PostLocalContactForce": True, "post_gid_option": False, "problem_name": "case",
             "solver_settings": {"strategy": "sphere_strategy"}}

    class Stage(DEMAnalysisStage):
        def read(self):
            return {tuple(node.Id for node in one.GetNodes()): round(one.GetValue(LOCAL_CONTACT_FORCE)[2], 1)
                    for one in self.contact_model_part.Elements}

        def InitializeSolutionStep(self):
            super().InitializeSolutionStep()
            self.spheres_model_part.ProcessInfo[Kratos.GRAVITY] = Kratos.Array3([0.0, -pulled(self.time), 0.0])

        def FinalizeSolutionStep(self):
            super().FinalizeSolutionStep()
            hook[round(self.time / h)] = self.read()

        def OutputSolutionStep(self):
            super().OutputSolutionStep()
            printed[round(self.time / h)] = self.read()

    Stage(Kratos.Model(), Kratos.Parameters(json.dumps(asked))).Run()
    return hook, printed


hook, printed = run([(0, 0.9999), (0, 0)], 0.05, lambda time: 9.81 if time < 0.035 else 109.81)
seen = [one.get((1, 2)) for one in (hook[200], printed[200], hook[390], hook[400], printed[400])]
turn = math.acos(0.51) + 0.005
_, two = run([(0.9999 * math.cos(turn) - 0.51, 0.9999 * math.sin(turn)), (-0.51, 0), (0.51, 0)], 0.15, lambda time: 9.81)
print("SAYS Kratos DEM", version("KratosDEMApplication"))
print("SAYS hook and output at 20 ms, N:", *seen[:2])
print("SAYS hook at 39 ms, hook and output at 40 ms, where 110 N press since 35 ms:", *seen[2:])
print("SAYS contacts in the mesh of a disc that rests on two:", two[1500])
holds = seen[0] == seen[3] == 0 and seen[1] == seen[2] == 9.8 and 100 < seen[4] < 115 and list(two[1500].values()) == [5.7]
sys.exit(0 if holds else 1)
E
code=0; OMP_NUM_THREADS=1 "$t/v/bin/python" case.py > said 2>&1 || code=$?
sed -n 's/^SAYS //p' said
[ $code = 0 ] || { tail -n 3 said; echo "the behaviour has changed" >&2; exit 1; }
