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
from yade import Vector3
from yade.wrapper import (
    Bo1_Box_Aabb,
    Bo1_Sphere_Aabb,
    ForceResetter,
    InsertionSortCollider,
    NewtonIntegrator,
    Omega,
    PyRunner,
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
from crowd_arms import Arms  # noqa: E402
from crowd_dumps import Dumps, Impulses  # noqa: E402
from crowd_guard import STOPPED, Guard  # noqa: E402
from crowd_law import interactions, law_of  # noqa: E402
from crowd_motion import Motion  # noqa: E402
from crowd_walls import Walls  # noqa: E402
from scene_file import (  # noqa: E402
    SceneFileError,
    acceleration,
    complete_drive,
    drive_force,
    limit_drive,
    penalty_of,
    read_disks,
    read_scene,
)

O = Omega()  # noqa: E741  (YADE's name)
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
    arguments = dict(word.split("=", 1) if "=" in word else (word, "") for word in words[1:])
    out = Path(arguments.pop("out", Path("out") / path.stem / "yade"))
    guarded = arguments.pop("guard", "yes")
    if guarded not in ("yes", "no"):
        raise SceneFileError(f"guard={guarded}: there are yes and no")
    scene = read_scene(path, arguments)
    disks = read_disks(path.parent / scene["disks"]["data"], scene["disks"].get("bodies"))
    complete_drive(scene.get("drive", {}), disks.bodies.mass)
    penalty = penalty_of(scene, disks)
    if "drive" in scene:
        limit_drive(scene, penalty.time_step)
    out.mkdir(parents=True, exist_ok=True)
    print(
        f"contact: {scene['contact']['law']}, stiffness {penalty.stiffness:g} N/m, "
        f"of walls {penalty.wall_stiffness:g} N/m, friction {penalty.friction:g}",
        f"damping ratio {penalty.damping_ratio:.15g}, dashpots {penalty.damping:.15g} N s/m "
        f"between disks, {penalty.wall_damping:.15g} N s/m at walls (hooke)",
        f"restitution: asked {scene['contact']['restitution']:g}, obtained "
        f"{penalty.restitution[0]:.15g} to {penalty.restitution[1]:.15g} over the masses",
        f"time step: {penalty.time_step:.15g} s, safe up to {penalty.safe_time_step:.15g} s, "
        f"{penalty.steps} steps, a frame every {penalty.frame_interval}",
        sep="\n",
    )
    if penalty.time_step > 1.000001 * penalty.safe_time_step:
        print("WARNING: the time step is longer than the safe one")
    crowd = Crowd(scene, disks, penalty, guarded == "yes")
    # where YADE looks for the commands of its observers
    main_module = sys.modules["__main__"]
    main_module.crowd_springs, main_module.crowd_joints = crowd.press, crowd.walls.take_back
    main_module.crowd_give, main_module.crowd_arms = crowd.walls.give, crowd.arms.press
    for name in crowd.after:
        setattr(main_module, f"crowd_{name}", getattr(crowd, name))
    names = ["bodies.dump", "contacts.dump"]
    if scene["run"].get("impulses"):
        names.append("impulses.dump")
    with contextlib.ExitStack() as files:
        for wall in crowd.walls.giving.values():
            wall.file = files.enter_context((out / f"wall_{wall.name}.txt").open("w"))
            wall.file.write("# step displacement_m velocity_m_per_s\n0 0 0\n")
        crowd.run(*(files.enter_context((out / name).open("w")) for name in names))
    if crowd.broken:
        print(crowd.broken, flush=True)
        sys.exit(STOPPED)


def runner(name, dead=True, **arguments):
    """What calls crowd_NAME of the main module; updateGlobals looks for new names at each call."""
    command = f"crowd_{name}()"
    return PyRunner(command=command, iterPeriod=1, updateGlobals=False, dead=dead, **arguments)


class Crowd:
    """YADE's bodies for a scene, and what happens between its steps.

    YADE keeps velocities half a step behind positions. The dumps hold those at the same instant, v
    + dt f/(2m), as LAMMPS does, and the first step is half a one, so that both engines compute the
    same numbers."""

    def __init__(self, scene, disks, penalty, guarded):
        self.guarded, self.broken, self.latest = guarded, "", (-1, ())
        self.scene, self.disks, self.penalty = scene, disks, penalty
        self.law = law_of(scene, penalty)
        self.motion = Motion(disks, O.materials.append(self.law.disk))
        arm = scene["contact"].get("arm_reach_m", 0.0)
        sphere = Bo1_Sphere_Aabb(aabbEnlargeFactor=1 + arm / disks.radius.min())
        collider = InsertionSortCollider([sphere, Bo1_Box_Aabb()], verletDist=SKIN_M)
        self.walls = Walls(scene.get("walls", []), self.law.wall, self.motion.states, collider)
        self.law.walls = set(self.walls.numbers)
        self.arms = Arms(scene["contact"], disks.radius, self.motion, self.walls)
        self.weight = disks.mass[:, None] * acceleration(scene)
        self.driving = np.zeros((len(disks.ids), 2))
        # what is done after a step, in this order, each at an interval of its own
        self.after = {name: runner(name) for name in ("add_impulses", "write", "drive", "observe")}
        O.engines = [
            ForceResetter(),
            collider,
            interactions(self.law),
            runner("springs", initRun=True, dead=not self.law.spring),
            runner("joints", initRun=True, dead=not self.walls.joints),
            runner("arms", initRun=True, dead=not arm),
            runner("give", initRun=True, dead=not self.walls.giving),
            NewtonIntegrator(damping=0.0),
            *self.after.values(),
        ]

    def run(self, bodies, contacts, impulses=None):
        """Run all steps, writing frames to the open files; impulses are summed where one is
        given."""
        self.dumps = Dumps(bodies, contacts, self.disks, self.walls.numbers)
        step = self.penalty.time_step
        self.impulses = Impulses(self.dumps, impulses, step) if impulses else None
        self._push(self.disks.bodies.centre, self.disks.bodies.velocity)
        # step 0: forces at the start, with no time passing
        O.dt = self.law.NO_TIME_S
        O.step()
        force = self.motion.force()
        self._let_go_of_touching(force)
        self._write(0, self.disks.position, self.disks.velocity, self.disks.spin, force)
        if self.guarded:
            stored = sum(self.law.energy(i) for i in self.walls.wall_contacts()) + self.arms.energy()
            self.guard = Guard(self.scene, self.disks, self.penalty, stored, self._check_apart)
            self.guard.moved = self.walls.moved
            self._every(self.guard.interval, "observe")
        self.motion.first_half_step(self.penalty.time_step, force)
        self.walls.begin(self.penalty.time_step)
        O.dt = self.penalty.time_step
        self._every(self.penalty.frame_interval, "write")
        if "drive" in self.scene:
            self._every(self.scene["run"]["drive_interval_steps"], "drive")
        if self.impulses:
            self._every(1, "add_impulses")
        O.run(self.penalty.steps, True)
        if self.last_written != self.penalty.steps and not self.broken:
            raise RuntimeError(f"stopped after step {self.last_written} of {self.penalty.steps}")

    def _every(self, steps, name):
        """Have something done after every so many steps."""
        runner = self.after[name]
        runner.iterPeriod = runner.firstIterRun = steps
        runner.dead = False

    def _let_go_of_touching(self, force):
        """Take away the damping of disks that touch without overlap: a contact begins with an
        overlap, as in LAMMPS."""
        for interaction in self.walls.wall_contacts():
            if interaction.geom.penetrationDepth <= 0:
                for body, sign in ((interaction.id1, 1.0), (interaction.id2, -1.0)):
                    if body not in self.walls.numbers:
                        force[body] += [sign * part for part in interaction.phys.normalForce.xy()]
                # impulses are sums of it
                interaction.phys.normalForce = Vector3.Zero

    def press(self):
        """Called when YADE has evaluated its contacts: add the springs of a law that it has not."""
        for interaction in O.interactions:
            if interaction.isReal:
                force = self.law.spring(interaction)
                interaction.phys.normalForce += force
                for body, way in ((interaction.id1, -force), (interaction.id2, force)):
                    O.forces.addF(body, way)

    def observe(self):
        """Called after a step at the guard's interval: stop a run that cannot be right."""
        step, dt = O.iter, self.penalty.time_step
        broken = self.guard.observe(self._position, self.motion.velocity, lambda: self._instant()[1])
        if broken:
            kind, words = broken
            self.broken = f"GUARD {kind} at t = {step * dt:.6g} s (step {step}): {words}"
            O.pause()

    def _check_apart(self):
        """The smallest distance of the centres of two disks that touch (m)."""
        in_contact = [one for one in self.walls.wall_contacts() if one.id2 not in self.walls.numbers]
        lengths = (one.geom.refR1 + one.geom.refR2 - one.geom.penetrationDepth for one in in_contact)
        return min(lengths, default=math.inf)

    def _position(self):
        """Where the disks are, (n,2) m; of this step, where it has been asked for."""
        return self.latest[1][2] if self.latest[0] == O.iter else self.motion.position()

    def _instant(self):
        """See Motion.instant."""
        if self.latest[0] != O.iter:
            self.latest = O.iter, self.motion.instant(self.penalty.time_step)
        return self.latest[1]

    def add_impulses(self):
        """Called after every step where impulses are summed."""
        written = O.iter % self.penalty.frame_interval == 0
        self._add_impulses(0.5 if written else 1.0)

    def _add_impulses(self, fraction):
        self.impulses.add(self.walls.wall_contacts(), self.arms.pushes, fraction)

    def write(self):
        """Called after the step of a frame."""
        now, dt = self._instant(), self.penalty.time_step
        self.walls.write(dt)
        self._write(O.iter, now[2], *self.motion.of_disks(dt, *now), self.motion.force())

    def drive(self):
        """Called after a step at the interval of the drive."""
        self._push(*self._instant()[:2])

    def _push(self, centre, velocity):
        """Set the forces that act until the next call: the drive, by where bodies are and how they move,
        and the body force."""
        if "drive" in self.scene:
            # within a step O.time is that of the step before
            time = O.iter * self.penalty.time_step
            at = (values[self.disks.bodies.of] for values in (centre, velocity))
            self.driving = drive_force(self.scene["drive"], self.disks, *at, time)
        self.motion.apply_forces(self.driving + self.weight)

    def _write(self, step, position, velocity, spin, force):
        drive = self.driving if "drive" in self.scene else None
        self.dumps.write_bodies(step, position, velocity, spin, force, drive)
        self.dumps.write_contacts(step, self.walls.wall_contacts())
        if self.impulses:
            self.impulses.write(step)
            self._add_impulses(0.5)
        self.last_written = step
        energy = 0.5 * float(self.disks.mass @ (velocity**2).sum(1))
        time = step * self.penalty.time_step
        print(f"{step:10d} {time:.6g} {len(self.disks.ids)} {energy:.8g}", flush=True)


try:
    main(sys.argv[1:])
except SceneFileError as error:
    print(f"ERROR: {error}", file=sys.stderr)
    sys.exit(1)
