"""Drake: `MultibodyPlant.get_contact_results_output_port()`, point pairs, whose force is on the second body.
Variants: the approximations of discrete contact. Bodies move in the plane by joints."""

from importlib.metadata import version

from pydrake.all import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiagramBuilder,
    DiscreteContactApproximation,
    HalfSpace,
    PlanarJoint,
    PrismaticJoint,
    RigidTransform,
    Simulator,
    SpatialInertia,
    Sphere,
    UnitInertia,
)  # fmt: skip
from record import Record, scene, variant

builder = DiagramBuilder()
plant, graph = AddMultibodyPlantSceneGraph(builder, scene.step_s / scene.substeps)
plant.set_discrete_contact_approximation(getattr(DiscreteContactApproximation, f"k{variant}"))
plant.mutable_gravity_field().set_gravity_vector([*scene.gravity, 0])
rubs = CoulombFriction(scene.friction, scene.friction)
for k, (x, y, nx, ny) in enumerate(scene.walls):
    pose = HalfSpace.MakePose([nx, ny, 0], [x, y, 0])
    plant.RegisterCollisionGeometry(plant.world_body(), pose, HalfSpace(), str(-1 - k), rubs)
bodies, starts = [], []
for k, (x, y, r, m, vx, vy) in enumerate(scene.bodies):
    body = plant.AddRigidBody(f"b{k}", SpatialInertia.SolidSphereWithMass(m, r))
    if scene.turns:
        joints = [plant.AddJoint(PlanarJoint(f"j{k}", plant.world_frame(), body.body_frame()))]
    else:
        none = SpatialInertia(0, [0, 0, 0], UnitInertia(0, 0, 0))
        between = plant.AddRigidBody(f"c{k}", none)
        joints = [plant.AddJoint(PrismaticJoint(f"x{k}", plant.world_frame(), between.body_frame(), [1, 0, 0])),
                  plant.AddJoint(PrismaticJoint(f"y{k}", between.body_frame(), body.body_frame(), [0, 1, 0]))]  # fmt: skip
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(r), str(k), rubs)
    bodies.append(body)
    starts.append((joints, (x, y), (vx, vy)))
plant.Finalize()
diagram = builder.Build()
simulator = Simulator(diagram)
context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
for joints, position, motion in starts:
    if scene.turns:
        joints[0].set_translation(context, position)
        joints[0].set_translational_velocity(context, motion)
    else:
        for joint, at, speed in zip(joints, position, motion, strict=True):
            joint.set_translation(context, at)
            joint.set_translation_rate(context, speed)


def of(geometry):
    return int(graph.model_inspector().GetName(geometry).split("::")[-1])


def state(body):
    pose, motion = body.EvalPoseInWorld(context), body.EvalSpatialVelocityInWorld(context)
    return [*pose.translation()[:2], *motion.translational()[:2], motion.rotational()[2]]


record = Record(version("drake"))
simulator.Initialize()
for step in record.steps():
    simulator.AdvanceTo(step * scene.step_s)
    found = plant.get_contact_results_output_port().Eval(context)
    pairs = [found.point_pair_contact_info(k) for k in range(found.num_point_pair_contacts())]
    rows = [(of(one.point_pair().id_A), of(one.point_pair().id_B), *one.contact_force()[:2]) for one in pairs]
    record.frame(step, [state(body) for body in bodies], rows)
