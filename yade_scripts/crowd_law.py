"""The contact law in YADE's terms: materials of disks and walls, and the functors that combine
them."""

import math

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


class Hooke:
    """max(0, k overlap + c approach), with a tangential spring where there is friction."""

    NO_TIME_S = 0.0

    def __init__(self, penalty):
        k, c, wall_c = penalty.stiffness, penalty.damping, penalty.wall_damping
        # YADE combines the values of two materials in series: 1/k = 1/k1 + 1/k2; the disk's 2c and
        # this give wall_c
        wall_cn = 2 * c * wall_c / (2 * c - wall_c) if c else 0.0
        common = {
            "kn": 2 * k,
            "ks": 2 * penalty.tangential_stiffness,
            "cs": 0.0,
            "frictionAngle": math.atan(penalty.friction),
            "density": 1.0,
        }
        self.disk, self.wall = ViscElMat(cn=2 * c, **common), ViscElMat(cn=wall_cn, **common)
        self.physics = Ip2_ViscElMat_ViscElMat_ViscElPhys()
        self.law = Law2_ScGeom_ViscElPhys_Basic()

    @staticmethod
    def energy(interaction):
        """The energy (J) of an overlap; the walls are as stiff as the disks."""
        overlap = max(0.0, interaction.geom.penetrationDepth)
        return 0.5 * interaction.phys.kn * overlap**2


class Hertz:
    """max(0, K sqrt(R) overlap^1.5 + sqrt(5) z sqrt(m K sqrt(R overlap)) approach), without
    friction.

    YADE's K is 4/3 of E1 E2/(E1 + E2) at Poisson's ratio 0. At a wall it takes half the disk's
    radius for R, and the walls' modulus makes up for it. Its damping is 2 b sqrt(m kn) with the
    tangent stiffness kn = 1.5 K sqrt(R overlap), so b = sqrt(5/6) z."""

    NO_TIME_S = 1e-300  # YADE divides by it here

    def __init__(self, penalty):
        young = 1.5 * penalty.hertz_stiffness
        common = {"poisson": 0.0, "frictionAngle": 0.0, "density": 1.0}
        self.disk = FrictMat(young=young, **common)
        self.wall = FrictMat(young=young / (math.sqrt(2) - 1), **common)
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
    return Hertz(penalty) if scene["contact"]["law"] == "hertz" else Hooke(penalty)


def interactions(law):
    """The loop over all contacts."""
    return InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()], [law.physics], [law.law]
    )
