"""A crowd of disks between straight walls, by the penalty method, in YADE. From the root of a
checkout:

    PYTHONPATH=yade_scripts yade -L noserver -n -x yade_scripts/crowd.py arch

README.md beside this file lists what may be given after the scene, and what the dumps hold. SI
units."""

import atexit
import contextlib
import math
import os
import sys
from pathlib import Path

import numpy as np
import yade.remote
from yade import Quaternion, Vector3, utils
from yade.wrapper import (
    Bo1_Box_Aabb,
    Bo1_Sphere_Aabb,
    ForceResetter,
    Ig2_Box_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_ViscElMat_ViscElMat_ViscElPhys,
    Law2_ScGeom_ViscElPhys_Basic,
    NewtonIntegrator,
    Omega,
    PyRunner,
    ViscElMat,
)

HERE = Path(sys.argv[0]).resolve().parent


def remove_temporary_folder():
    """YADE makes a folder for temporary files at its start and leaves it behind."""
    with contextlib.suppress(OSError):
        os.rmdir(os.path.dirname(Omega().tmpFilename()))


if not str(getattr(yade.remote, "__file__", "")).startswith(str(HERE)):
    # started without `-L noserver`: start again with it, so that no port stays open
    os.environ["PYTHONPATH"] = os.pathsep.join(
        filter(None, [str(HERE), os.environ.get("PYTHONPATH")])
    )
    sys.stdout.flush()
    remove_temporary_folder()
    os.execv(sys.yade_argv[0], [sys.yade_argv[0], "-L", "noserver", *sys.yade_argv[1:]])

atexit.register(remove_temporary_folder)
sys.path.insert(0, str(HERE))
from crowd_guard import STOPPED, Guard  # noqa: E402
from scene_file import SceneFileError, drive_force, penalty_of, read_disks, read_scene  # noqa: E402

O = Omega()  # noqa: E741  (YADE's name)
WALL_HALF_HEIGHT_M = 1.0  # across the plane of the disks
CONTACT_ROW = "%d %d %d %.17g %.17g %.17g %.17g %.17g\n"
SKIN_M = 0.04  # changes the speed only


def main(words):
    """Run the scene named first, with the given key=value words; write the dumps."""
    if not words:
        raise SceneFileError("which scene? yade … crowd.py SCENE [key=value …]")
    path = (
        Path(words[0])
        if words[0].endswith(".toml")
        else HERE.parent / "scenes" / f"{words[0]}.toml"
    )
    given = dict(word.split("=", 1) if "=" in word else (word, "") for word in words[1:])
    out = Path(given.pop("out", Path("out") / path.stem / "yade"))
    guarded = given.pop("guard", "yes")
    if guarded not in ("yes", "no"):
        raise SceneFileError(f"guard={guarded}: there are yes and no")
    scene = read_scene(path, given)
    disks = read_disks(path.parent / scene["disks"]["data"])
    penalty = penalty_of(scene, disks.mass)
    out.mkdir(parents=True, exist_ok=True)
    print(
        f"contact: hooke, stiffness {penalty.stiffness:g} N/m, friction {penalty.friction:g}\n"
        f"damping ratio {penalty.damping_ratio:.15g}, dashpots {penalty.damping:.15g} N s/m between disks, "
        f"{penalty.wall_damping:.15g} N s/m at walls\n"
        f"restitution: asked {scene['contact']['restitution']:g}, obtained {penalty.restitution[0]:.15g} to "
        f"{penalty.restitution[1]:.15g} over the masses\n"
        f"time step: {penalty.time_step:.15g} s, safe up to {penalty.safe_time_step:.15g} s; "
        f"{penalty.steps} steps, a frame every {penalty.frame_interval}"
    )
    if penalty.time_step > 1.000001 * penalty.safe_time_step:
        print("WARNING: the time step is longer than the safe one")
    crowd = Crowd(scene, disks, penalty, guarded == "yes")
    sys.modules[
        "__main__"
    ].crowd_after_step = crowd.after_step  # where YADE looks for the observer's command
    sys.modules["__main__"].crowd_guard = crowd.look
    with (out / "bodies.dump").open("w") as bodies, (out / "contacts.dump").open("w") as contacts:
        crowd.run(bodies, contacts)
    if crowd.broken:
        print(crowd.broken, flush=True)
        sys.exit(STOPPED)


def in_plane(vectors):
    """x and y of YADE's vectors, (n,2)."""
    return np.array([(vector[0], vector[1]) for vector in vectors])


class Crowd:
    """YADE's bodies for a scene, and what happens between its steps.

    YADE keeps velocities half a step behind positions. The dumps hold those at the same instant, v
    + dt f/(2m), as LAMMPS does, and the first step is half a one, so that both engines compute the
    same numbers."""

    def __init__(self, scene, disks, penalty, guarded):
        self.guarded, self.broken, self.seen = guarded, "", (-1, None)
        self.scene, self.disks, self.penalty = scene, disks, penalty
        k, c, wall_c, kt = (
            penalty.stiffness,
            penalty.damping,
            penalty.wall_damping,
            penalty.tangential_stiffness,
        )
        # YADE combines the values of two materials in series: 1/k = 1/k1 + 1/k2; the disk's 2c and
        # this give wall_c
        wall_cn = 2 * c * wall_c / (2 * c - wall_c) if c else 0.0
        angle = math.atan(penalty.friction)
        common = {"kn": 2 * k, "ks": 2 * kt, "cs": 0.0, "frictionAngle": angle, "density": 1.0}
        self.material = O.materials.append(ViscElMat(cn=2 * c, **common))
        self.wall_material = O.materials.append(ViscElMat(cn=wall_cn, **common))
        self.states = [
            self._add_disk(*row)
            for row in zip(
                disks.radius, disks.mass, disks.position, disks.velocity, disks.spin, strict=True
            )
        ]
        walls = scene.get("walls", [])
        self.wall_numbers = {
            self._add_wall(wall): number for number, wall in enumerate(walls, start=1)
        }
        self.held = np.zeros((len(disks.ids), 2))
        self.observer = PyRunner(command="crowd_after_step()", iterPeriod=1, dead=True)
        self.watch = PyRunner(command="crowd_guard()", iterPeriod=1, dead=True)
        O.engines = [
            ForceResetter(),
            InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verletDist=SKIN_M),
            InteractionLoop(
                [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
                [Ip2_ViscElMat_ViscElMat_ViscElPhys()],
                [Law2_ScGeom_ViscElPhys_Basic()],
            ),
            NewtonIntegrator(damping=0.0),
            self.observer,
            self.watch,
        ]

    def _add_disk(self, radius, mass, position, velocity, spin):
        body = utils.sphere((*map(float, position), 0.0), float(radius), material=self.material)
        state = body.state
        state.mass = float(mass)
        state.inertia = Vector3.Ones * (0.5 * float(mass) * float(radius) ** 2)
        state.blockedDOFs = "zXY"
        state.vel = Vector3(*map(float, velocity), 0.0)
        state.angVel = Vector3(0.0, 0.0, float(spin))
        return O.bodies[O.bodies.append(body)].state

    def _add_wall(self, wall):
        (x0, y0), (x1, y1) = wall["start_m"], wall["end_m"]
        half, turn = (0.5 * abs(x1 - x0), 0.5 * abs(y1 - y0)), 0.0
        if half[0] and half[1]:  # slanted; the others need no turn and so no rounding
            half, turn = (math.hypot(*half), 0.0), math.atan2(y1 - y0, x1 - x0)
        box = utils.box(
            (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0),
            (*half, WALL_HALF_HEIGHT_M),
            orientation=Quaternion(Vector3(0, 0, 1), turn),
            fixed=True,
            material=self.wall_material,
        )
        return O.bodies.append(box)

    def run(self, bodies, contacts):
        """Run all steps, writing frames to the two open files."""
        self.bodies, self.contacts = bodies, contacts
        if "drive" in self.scene:
            self._push(self.disks.position, self.disks.velocity)
        # step 0: forces at the start, with no time passing
        O.dt = 0.0
        O.step()
        force = in_plane(map(O.forces.f, range(len(self.states))))
        self._let_go_of_touching(force)
        self._write(0, self.disks.position, self.disks.velocity, self.disks.spin, force)
        if self.guarded:
            self.guard = Guard(self.scene, self.disks, self.penalty, O.interactions)
            self.watch.iterPeriod = self.watch.firstIterRun = self.guard.interval
            self.watch.dead = False
        self._first_half_step(force)
        O.dt = self.penalty.time_step
        every = [self.penalty.frame_interval] + (
            [self.scene["run"]["drive_interval_steps"]] if "drive" in self.scene else []
        )
        self.observer.iterPeriod = self.observer.firstIterRun = math.gcd(*every)
        self.observer.dead = False
        O.run(self.penalty.steps, True)
        if self.last_written != self.penalty.steps and not self.broken:
            raise RuntimeError(f"stopped after step {self.last_written} of {self.penalty.steps}")

    def _let_go_of_touching(self, force):
        """Take away the damping of disks that touch without overlap: a contact begins with an
        overlap, as in LAMMPS."""
        for interaction in O.interactions:
            if interaction.isReal and interaction.geom.penetrationDepth <= 0:
                for body, sign in ((interaction.id1, 1.0), (interaction.id2, -1.0)):
                    if body not in self.wall_numbers:
                        force[body] += sign * in_plane([interaction.phys.normalForce])[0]

    def _first_half_step(self, force):
        half, dt = 0.5 * self.penalty.time_step, self.penalty.time_step
        for body, state in enumerate(self.states):
            state.vel = state.vel + half / state.mass * Vector3(*map(float, force[body]), 0.0)
            state.angVel = state.angVel + half / state.inertia[2] * O.forces.t(body)
            state.pos = state.pos + dt * state.vel

    def look(self):
        """Called after a step at the guard's interval: stop a run that cannot be right."""
        step, dt = O.iter, self.penalty.time_step
        broken = self.guard.look(
            self._position, lambda: in_plane([state.vel for state in self.states])
        )
        if broken:
            kind, words = broken
            self.broken = f"GUARD {kind} at t = {step * dt:.6g} s (step {step}): {words}"
            O.pause()

    def _position(self):
        """Where the disks are after this step, (n,2) m; the observer may have asked already."""
        step, position = self.seen
        return position if step == O.iter else in_plane([state.pos for state in self.states])

    def after_step(self):
        """Called after YADE has moved the disks from this step to the next one."""
        step = O.iter
        dt, half = self.penalty.time_step, 0.5 * self.penalty.time_step
        mass, inertia = self.disks.mass, 0.5 * self.disks.mass * self.disks.radius**2
        forces, bodies = O.forces, range(len(self.states))
        force = in_plane(map(forces.f, bodies))
        later = in_plane([state.vel for state in self.states])
        position = in_plane([state.pos for state in self.states]) - dt * later
        velocity = later - half * force / mass[:, None]
        self.seen = step, position
        if step % self.penalty.frame_interval == 0:
            torque = np.array([forces.t(body)[2] for body in bodies])
            spin = np.array([state.angVel[2] for state in self.states]) - half * torque / inertia
            self._write(step, position, velocity, spin, force)
        if "drive" in self.scene and step % self.scene["run"]["drive_interval_steps"] == 0:
            self._push(position, velocity)

    def _push(self, position, velocity):
        self.held = drive_force(self.scene["drive"], self.disks.mass, position, velocity)
        set_force = O.forces.setPermF
        for body, (x, y) in enumerate(self.held.tolist()):
            set_force(body, (x, y, 0.0))

    def _write(self, step, position, velocity, spin, force):
        disks = self.disks
        columns = [
            disks.ids,
            np.ones(len(disks.ids)),
            position,
            np.zeros(len(disks.ids)),
            disks.radius,
            disks.mass,
        ]
        columns += [velocity, np.zeros(len(disks.ids)), spin, force]
        names = "id type x y z radius mass vx vy vz omegaz fx fy"
        if "drive" in self.scene:
            columns, names = [*columns, self.held], names + " drive_x drive_y"
        table = np.column_stack(columns)
        row = "%d %d" + " %.17g" * (table.shape[1] - 2) + "\n"
        self._head(self.bodies, step, len(table), "ATOMS", names)
        self.bodies.writelines(row % tuple(values) for values in table.tolist())
        rows = sorted(
            filter(None, map(self._contact, O.interactions)),
            key=lambda values: (values[2], *values[:2]),
        )
        self._head(
            self.contacts, step, len(rows), "ENTRIES", "first second is_wall nx ny overlap fx fy"
        )
        self.contacts.writelines(CONTACT_ROW % values for values in rows)
        self.last_written = step
        energy = 0.5 * float(disks.mass @ (velocity**2).sum(1))
        print(
            f"{step:10d} {step * self.penalty.time_step:.6g} {len(table)} {energy:.8g}", flush=True
        )

    def _head(self, file, step, count, kind, names):
        box = "".join(self.disks.box)
        file.write(
            f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {kind}\n{count}\nITEM: BOX BOUNDS ff ff pp\n{box}"
        )
        file.write(f"ITEM: {kind} {names}\n")

    def _contact(self, interaction):
        """A row of the contact dump: the first disk, the second disk or the wall, and what the
        first does to it."""
        overlap = interaction.geom.penetrationDepth
        if not interaction.isReal or overlap <= 0:
            return None
        normal, force = (
            interaction.geom.normal,
            interaction.phys.normalForce + interaction.phys.shearForce,
        )
        first, second = interaction.id1, interaction.id2
        wall = first in self.wall_numbers or second in self.wall_numbers
        if first in self.wall_numbers or (not wall and first > second):
            first, second, normal, force = second, first, -normal, -force
        other = self.wall_numbers[second] if wall else self.disks.ids[second]
        # + 0.0: no negative zeros
        return (
            self.disks.ids[first],
            other,
            wall,
            normal[0] + 0.0,
            normal[1] + 0.0,
            overlap,
            force[0] + 0.0,
            force[1] + 0.0,
        )


try:
    main(sys.argv[1:])
except SceneFileError as error:
    print(f"ERROR: {error}", file=sys.stderr)
    sys.exit(1)
