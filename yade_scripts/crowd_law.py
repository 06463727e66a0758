"""The contact law in YADE's terms: materials of disks and walls, and the functors that combine
them."""

import math

from scene_file import LAWS
from yade.wrapper import (
    FrictMat,
    Ig2_Box_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_MindlinPhys,
    Ip2_ViscElMat_ViscElMat_ViscElPhys,
    Law2_ScGeom_MindlinPhys_Mindlin,
    Law2_ScGeom_ViscElPhys_Basic,
    MatchMaker,
    ViscElMat,
)


def beside(one, both):
    """The value that gives `both` in series with `one`, 1/both = 1/one + 1/value, as YADE combines
    two materials: negative where both > one, and 0 for an infinite one, which YADE leaves out."""
    return 0.0 if both == one else one * both / (one - both)


class Hooke:
    """max(0, k overlap + c approach), with a tangential spring where there is friction."""

    NO_TIME_S = 0.0
    spring = None

    def __init__(self, penalty):
        disks = penalty.stiffness, penalty.tangential_stiffness, penalty.damping
        walls = penalty.wall_stiffness, penalty.wall_tangential_stiffness, penalty.wall_damping
        angle = math.atan(penalty.friction)
        self.disk, self.wall = (
            ViscElMat(kn=kn, ks=ks, cn=cn, cs=0.0, frictionAngle=angle, density=1.0)
            for kn, ks, cn in (
                [2 * value for value in disks],
                [beside(2 * one, both) for one, both in zip(disks, walls, strict=True)],
            )
        )
        self.physics = Ip2_ViscElMat_ViscElMat_ViscElPhys()
        self.law = Law2_ScGeom_ViscElPhys_Basic()

    @staticmethod
    def energy(interaction):
        """The energy (J) of an overlap."""
        overlap = max(0.0, interaction.geom.penetrationDepth)
        return 0.5 * interaction.phys.kn * overlap**2


class Apart(Hooke):
    """k overlap + q overlap^2, and max(0, c approach): YADE has a dashpot alone for it, and the spring
    is added to each contact after YADE's own loop."""

    def __init__(self, penalty):
        super().__init__(penalty)
        self.disk.kn = self.wall.kn = 0.0
        self.walls = set()  # the bodies that are walls
        self.springs, self.wall_springs = penalty.springs, penalty.wall_springs

    def _spring_of(self, interaction):
        """The overlap (m), and k and q of the spring."""
        wall = interaction.id1 in self.walls or interaction.id2 in self.walls
        k, _, q = self.wall_springs if wall else self.springs
        return max(0.0, interaction.geom.penetrationDepth), k, q

    def spring(self, interaction):
        """The force (N) of the spring on the second body."""
        overlap, k, q = self._spring_of(interaction)
        return (k + q * overlap) * overlap * interaction.geom.normal

    def energy(self, interaction):
        """The energy (J) of an overlap."""
        overlap, k, q = self._spring_of(interaction)
        return (0.5 * k + q / 3 * overlap) * overlap**2


class Hertz:
    """max(0, K sqrt(R) overlap^1.5 + sqrt(5) z sqrt(m K sqrt(R overlap)) approach), without
    friction.

    YADE's K is 4/3 of E1 E2/(E1 + E2) at Poisson's ratio 0. At a wall it takes half the disk's
    radius for R, and the walls' modulus makes up for it: E1 E2/(E1 + E2) is sqrt(2) K_wall/K of
    what it is of two disks. Its damping is 2 b sqrt(m kn) with the
    tangent stiffness kn = 1.5 K sqrt(R overlap), so b = sqrt(5/6) z."""

    NO_TIME_S = 1e-300  # YADE divides by it here
    spring = None

    def __init__(self, penalty):
        (_, disks, _), (_, walls, _) = penalty.springs, penalty.wall_springs
        young = 1.5 * disks
        common = {"poisson": 0.0, "frictionAngle": 0.0, "density": 1.0}
        self.disk = FrictMat(young=young, **common)
        fraction = walls / (math.sqrt(2) * disks)
        self.wall = FrictMat(young=beside(young, fraction * young), **common)
        damping = math.sqrt(5 / 6) * penalty.damping_ratio
        self.physics = Ip2_FrictMat_FrictMat_MindlinPhys(
            betan=MatchMaker(algo="val", val=damping), betas=MatchMaker(algo="val", val=0.0)
        )
        self.law = Law2_ScGeom_MindlinPhys_Mindlin()

    @staticmethod
    def energy(interaction):
        """The energy (J) of an overlap."""
        return 0.4 * interaction.phys.kno * max(0.0, interaction.geom.penetrationDepth) ** 2.5


def law_of(scene, penalty):
    """The law that the scene asks for."""
    kinds = {"clipped": Hooke, "apart": Apart, "tangent": Hertz}
    return kinds[LAWS[scene["contact"]["law"]][0]](penalty)


def interactions(law):
    """The loop over all contacts."""
    return InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()], [law.physics], [law.law]
    )
