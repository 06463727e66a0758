"""Contacts of a YADE run as a table: call `add()` after each step that is written, `write()` at the end."""

from pathlib import Path

from yade import wrapper as yade

LINES = ["step,first,second,is_wall,fx,fy"]


def add():
    scene = yade.Omega()
    for i in (one for one in scene.interactions if one.isReal):
        on_second, wall = i.phys.normalForce + i.phys.shearForce, {i.id1, i.id2}
        wall = {k for k in wall if not isinstance(scene.bodies[k].shape, yade.Sphere)}
        one, other, sign = (i.id2, i.id1, -1) if i.id1 in wall else (i.id1, i.id2, 1)
        ids = f"{scene.iter},{one + 1},{0 if wall else other + 1},{bool(wall)}"  # YADE's are from 0
        LINES.append(f"{ids},{sign * on_second[0]!r},{sign * on_second[1]!r}")


def write(path="contacts.csv"):
    Path(path).write_text("\n".join(LINES) + "\n", encoding="utf-8")
