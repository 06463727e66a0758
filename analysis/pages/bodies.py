"""What rigid disks over- and understate at the stiffness of people, as a table of any page."""

from analysis.engines.softness import judged, known_bodies, rigid_over_soft, softness_of
from analysis.pages.numbers import interval, signed
from analysis.pages.section import Cell, Table
from analysis.pages.words import Words
from analysis.scene.scene import Scene


def ladder(scene: Scene) -> tuple[list[tuple[str, str, str]], list[list[str]]]:
    """Give each source of stiffness, softest first, with kN/m and s of a driven crowd, and a row
    per quantity: its name, and by how much rigid disks are above such bodies."""
    rigid_over_soft_of = rigid_over_soft(1.0, 1.0)
    assert rigid_over_soft_of is not None
    bodies, rows = [], [[one.words] for one in rigid_over_soft_of.values()]
    for body in known_bodies().values():
        hardest, softest = softness_of(scene, body)
        stiffness = interval([end / 1000 for end in (body.low_N_per_m, body.high_N_per_m)])
        bodies.append((body.words, stiffness, interval((hardest, softest), 2)))
        found = rigid_over_soft(softest, hardest)
        for row, key in zip(rows, rigid_over_soft_of, strict=True):
            if found is None:
                row.append(f"not measured: {judged(softest).split(':')[0]}")
            else:
                one = found[key]
                row.append(f"{signed(one.mean)} ({signed(one.low)} to {signed(one.high)})")
    return bodies, rows


def ladder_table(scene: Scene) -> Table:
    """Put the ladder of a driven crowd into a table."""
    bodies, rows = ladder(scene)
    cells: list[list[Cell]] = [list(row) for row in rows]
    return Words(__package__).table("ladder", cells, bodies=bodies)
