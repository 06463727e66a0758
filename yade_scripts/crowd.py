"""A crowd of disks between straight walls, by the penalty method, in YADE. From the root of a checkout:

    PYTHONPATH=yade_scripts yade -L noserver -n -x yade_scripts/crowd.py arch

README.md beside this file lists what may be given after the scene, and what the dumps hold. SI units.
"""

import math
import os
import sys
from pathlib import Path

import numpy as np
import yade.remote
from yade import Matrix3, Quaternion, Vector3, utils
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
if not str(getattr(yade.remote, "__file__", "")).startswith(str(HERE)):
    # started without `-L noserver`: start again with it, so that no port stays open
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(HERE), os.environ.get("PYTHONPATH")]))
    sys.stdout.flush()
    os.execv(sys.yade_argv[0], [sys.yade_argv[0], "-L", "noserver", *sys.yade_argv[1:]])
