"""What a script of an engine needs: the scene that it is given, and the files that it writes. No packages.

    python SCRIPT SCENE.json FOLDER VARIANT

writes `bodies.dump` and `contacts.csv`, which `percussions audit` reads, and `engine.json`: version, seconds
from frame to frame."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

scene = SimpleNamespace(**json.loads(Path(sys.argv[1]).read_text()))
folder, variant = Path(sys.argv[2]), sys.argv[3]


class Record:
    """Frames of steps of `step` seconds. Bodies are numbered from 0, walls −1, −2, … in the scene's order."""

    def __init__(self, version, step=None):
        self.step = step or scene.step_s
        self.first, self.last = (round(t / self.step) for t in (scene.from_s, scene.until_s))
        folder.mkdir(parents=True, exist_ok=True)
        self.named(version)
        self.bodies, self.contacts = ((folder / name).open("w") for name in ("bodies.dump", "contacts.csv"))
        self.before = [(x, y, vx, vy, 0.0) for x, y, _, _, vx, vy in scene.bodies]
        self.contacts.write("step,first,second,is_wall,fx,fy\n")

    def named(self, version):
        """Write the version of the engine."""
        (folder / "engine.json").write_text(json.dumps({"version": version, "step_s": self.step}))

    def steps(self):
        """Give the numbers of all steps, from 1."""
        return range(1, self.last + 1)

    def wanted(self, step):
        return self.first <= step <= self.last

    def frame(self, step, bodies, contacts, same=False):
        """Write a step: of each body x, y, vx, vy, spin after it; of each contact first, second and the
        force (N) on the second. Forces stand beside the bodies before the step, whose contacts they are,
        unless they are of the `same` instant."""
        before, self.before = self.before, bodies
        if not self.wanted(step):
            return
        bodies = bodies if same else before
        n = len(scene.bodies)
        self.bodies.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{n}\nITEM: BOX BOUNDS ff ff pp\n"
                          + "-99 99\n" * 3 + "ITEM: ATOMS id x y radius mass vx vy omegaz\n")
        for k, ((*_, r, m, _, _), (x, y, *rest)) in enumerate(zip(scene.bodies, bodies, strict=True)):
            self.bodies.write(" ".join(repr(float(v)) for v in (x, y, r, m, *rest)).join((f"{k + 1} ", "\n")))
        for first, second, fx, fy in contacts:
            if first < 0:
                first, second, fx, fy = second, first, -fx, -fy
            wall = second < 0
            self.contacts.write(f"{step},{first + 1},{-second if wall else second + 1},{wall},{float(fx)!r},{float(fy)!r}\n")
