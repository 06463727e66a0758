"""MuJoCo: `mj_contactForce` of each contact after `mj_step`. Bodies slide in the plane (and turn about its
normal) by joints, so that nothing leaves it. Variants are integrators."""

import mujoco
import numpy as np
from record import Record, scene, variant

step = scene.step_s / scene.substeps
hinge = '<joint type="hinge" axis="0 0 1"/>' if scene.turns else ""
slides = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0"))
walls = "".join(f'<geom name="{-1 - k}" type="plane" size="99 99 1" pos="{x} {y} 0" zaxis="{nx} {ny} 0"/>'
                for k, (x, y, nx, ny) in enumerate(scene.walls))  # fmt: skip
bodies = "".join(
    f'<body pos="{x} {y} 0">{slides}{hinge}<geom name="{k}" type="sphere" size="{r}" mass="{m}"/></body>'
    for k, (x, y, r, m, _, _) in enumerate(scene.bodies)
)
model = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="{step}" integrator="{variant}"
    gravity="{scene.gravity[0]} {scene.gravity[1]} 0" cone="elliptic"/>
    <default><geom friction="{scene.friction} 0 0" condim="{3 if scene.friction else 1}"/></default>
    <worldbody>{walls}{bodies}</worldbody></mujoco>""")
data, n = mujoco.MjData(model), len(scene.bodies)
data.qvel.reshape(n, -1)[:, :2] = np.array(scene.bodies)[:, 4:]


def force(k):
    """The force of contact k in the frame of the world; its frame has axes in rows."""
    found = np.zeros(6)
    mujoco.mj_contactForce(model, data, k, found)
    return (data.contact[k].frame.reshape(3, 3).T @ found[:3])[:2]


record = Record(mujoco.__version__)
for number in record.steps():
    for _ in range(scene.substeps):
        mujoco.mj_step(model, data)
    listed = [(*(int(model.geom(i).name) for i in one.geom), *force(k)) for k, one in enumerate(data.contact)]
    position = data.qpos.reshape(n, -1)[:, :2] + np.array(scene.bodies)[:, :2]
    motion = data.qvel.reshape(n, -1)
    spin = motion[:, 2] if scene.turns else np.zeros(n)
    record.frame(number, np.column_stack([position, motion[:, :2], spin]), listed)
