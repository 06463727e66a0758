"""Kratos DEM: `LOCAL_CONTACT_FORCE` of the contact elements, in the frame of each pair (its third axis is the normal),
and `RIGID_ELEMENT_FORCE`, the sum of all walls on a disc, given to the nearest wall. Variants: after the output of
each step (`printed`), or in `FinalizeSolutionStep` with output each 0.01 s, the default (`hook`). Discs are 1 m deep."""

# ruff: noqa: N802

import json
import math
import os
from importlib.metadata import version
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"
import KratosMultiphysics as Kratos
import KratosMultiphysics.DEMApplication as Dem
from KratosMultiphysics.DEMApplication.DEM_analysis_stage import DEMAnalysisStage
from record import Record, folder, scene, variant

h, (_, _, r, m, *_), inputs = scene.fine_step_s, scene.bodies[0], json.loads(Path(__file__).with_name("kratos.json").read_text())
for one in inputs["materials"]["materials"]:
    one["Variables"] |= {"PARTICLE_DENSITY": m / (math.pi * r * r), "YOUNG_MODULUS": scene.stiffness * 8 / math.pi}
for one in inputs["materials"]["material_relations"]:
    one["Variables"] |= {"STATIC_FRICTION": scene.friction, "DYNAMIC_FRICTION": scene.friction}
requested = inputs["asked"] | {
    "GravityX": scene.gravity[0], "GravityY": scene.gravity[1], "RotationOption": scene.turns, "MaxTimeStep": h,
    "FinalTime": scene.until_s - h / 2, "OutputTimeStep": h if variant == "printed" else 0.01,
}  # fmt: skip


def block(kind, rows):
    """Give a block of an mdpa file, of rows numbered from 1."""
    lines = [" ".join(map(str, (k, *row))) for k, row in enumerate(rows, 1)]
    return "\n".join([f"Begin {kind}", *lines, f"End {kind.split()[0]}", ""])


bodies, ends = scene.bodies, [(x - 99 * s * ny, y + 99 * s * nx, 0) for x, y, nx, ny in scene.walls for s in (1, -1)]
known = {"RADIUS": 2, "VELOCITY_X": 4, "VELOCITY_Y": 5}
values = [block(f"NodalData {name}", [(0, body[at]) for body in bodies]) for name, at in known.items()]
elements = block("Elements CylinderParticle2D", [(1, k) for k in range(1, len(bodies) + 1)])
discs = [block("Nodes", [(*body[:2], 0) for body in bodies]), elements]
edges = [block("Nodes", ends), block("Conditions RigidEdge2D2N", [(2, 2 * k + 1, 2 * k + 2) for k in range(len(scene.walls))])]
os.chdir(folder)
(folder / "MaterialsDEM.json").write_text(json.dumps(inputs["materials"]))
(folder / "sceneDEM.mdpa").write_text("".join(["Begin Properties 1\nEnd Properties\n", *discs, *values]))
(folder / "sceneDEM_FEM_boundary.mdpa").write_text("".join(["Begin Properties 2\nEnd Properties\n", *edges]))


def contacts(stage):
    """Give the contacts of the places before the step."""
    at = stage.before
    for element in stage.contact_model_part.Elements:
        i, j = (node.Id - 1 for node in element.GetNodes())
        x, y = at[i][0] - at[j][0], at[i][1] - at[j][1]
        x, y = x / math.hypot(x, y), y / math.hypot(x, y)
        one, other, along = element.GetValue(Dem.LOCAL_CONTACT_FORCE)
        across = one if abs(x) >= 0.577 else -other * math.copysign(1, y)  # its axes change there
        yield j, i, along * x - across * y, along * y + across * x
    for k, node in enumerate(stage.spheres_model_part.Nodes):
        far = [(at[k][0] - x) * nx + (at[k][1] - y) * ny for x, y, nx, ny in scene.walls]
        yield k, -1 - far.index(min(far)), *[*node.GetSolutionStepValue(Dem.RIGID_ELEMENT_FORCE)][:2]


class Stage(DEMAnalysisStage):
    steps = 0

    def noted(self, here):
        if here == variant and not self.steps % scene.substeps:
            record.frame(self.steps // scene.substeps, self.before, [row for row in contacts(self) if any(row[2:])], same=True)

    def InitializeSolutionStep(self):
        super().InitializeSolutionStep()
        self.steps += 1
        each = [(node, node.GetSolutionStepValue(Kratos.VELOCITY)) for node in self.spheres_model_part.Nodes]
        self.before = [(node.X, node.Y, v[0], v[1], node.GetSolutionStepValue(Kratos.ANGULAR_VELOCITY_Z)) for node, v in each]

    def FinalizeSolutionStep(self):
        super().FinalizeSolutionStep()
        self.noted("hook")

    def OutputSolutionStep(self):
        super().OutputSolutionStep()
        self.noted("printed")


record = Record(version("KratosDEMApplication"), h * scene.substeps)
Stage(Kratos.Model(), Kratos.Parameters(json.dumps(requested))).Run()
