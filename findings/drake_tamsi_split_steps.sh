#!/usr/bin/env bash
# Drake 1.51.1, contact results of the discrete contact approximation kTamsi (multibody/plant/tamsi_driver.cc).
# One would guess: the contact forces that a plant reports after a step are those that made the step, as with kLagged,
#   kSimilar and kSap to ten digits.
# What happens: where TAMSI does not converge it makes the step in parts, and reports the forces of the last one. Twelve
#   spheres fall into a corner: in one step of 5 ms the walls give them 187 N, and the results list 50 N.
# Who is hurt: whoever adds up contact forces of impacts with kTamsi. The steps that were split are not marked.
set -euo pipefail
t=$(mktemp -d); trap 'rm -rf "$t"' EXIT
python3 -m venv "$t/v"; "$t/v/bin/pip" install -q --no-compile --disable-pip-version-check drake==1.51.1
"$t/v/bin/python" -W ignore - <<'E'
import sys
from importlib.metadata import version
import numpy as np
from pydrake.all import (
    AddMultibodyPlantSceneGraph, CoulombFriction, DiagramBuilder, DiscreteContactApproximation as Model, HalfSpace,
    PlanarJoint, RigidTransform, Simulator, SpatialInertia, Sphere,
)
print("Drake", version("drake"))
H, G, RUBS = 0.005, np.array([-4.0, -7.0, 0.0]), CoulombFriction(0.3, 0.3)


def steps_off(model):
    """Steps in which the reported forces of the walls are not those that the momentum of all needs: number, N, N."""
    builder = DiagramBuilder()
    plant, graph = AddMultibodyPlantSceneGraph(builder, H)
    plant.set_discrete_contact_approximation(model)
    plant.mutable_gravity_field().set_gravity_vector(G)
    world = plant.world_body()
    for k, normal in enumerate(np.eye(3)[:2]):
        plant.RegisterCollisionGeometry(world, HalfSpace.MakePose(normal, np.zeros(3)), HalfSpace(), f"w{k}", RUBS)
    balls = [plant.AddRigidBody(f"b{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1)) for k in range(12)]
    joints = [plant.AddJoint(PlanarJoint(f"j{k}", world.body_frame(), ball.body_frame())) for k, ball in enumerate(balls)]
    for k, ball in enumerate(balls):
        plant.RegisterCollisionGeometry(ball, RigidTransform(), Sphere(0.1), f"s{k}", RUBS)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    for k, joint in enumerate(joints):
        joint.set_translation(context, [0.11 + 0.21 * (k // 3) + 0.01 * (k % 2), 0.11 + 0.21 * (k % 3)])
    simulator.Initialize()
    off = []
    for step in range(1, 61):
        before = sum(ball.EvalSpatialVelocityInWorld(context).translational() for ball in balls)
        simulator.AdvanceTo(step * H)
        change = sum(ball.EvalSpatialVelocityInWorld(context).translational() for ball in balls) - before
        needed, told = change / H - 12 * G, np.zeros(3)
        results = plant.get_contact_results_output_port().Eval(context)
        for k in range(results.num_point_pair_contacts()):
            one = results.point_pair_contact_info(k)
            told += one.contact_force() * (int(one.bodyA_index() == world.index()) - int(one.bodyB_index() == world.index()))
        if np.abs(needed - told).max() > max(0.01 * np.abs(needed).max(), 1e-6):
            off.append((step, needed[0].round(1), told[0].round(1)))
    return off


found = {name: steps_off(getattr(Model, name)) for name in ("kTamsi", "kLagged", "kSap")}
for name, off in found.items():
    print(name, "steps that are more than 1 % off:", *(f"{k}: x of walls {a} N needed, {b} N reported" for k, a, b in off))
sys.exit(0 if found["kTamsi"] and not found["kLagged"] and not found["kSap"] else "the behaviour has changed")
E
