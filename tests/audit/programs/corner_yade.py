import math, yade.remote
from yade import Vector3
from yade import *
from yade.wrapper import *
from yade import utils
O=Omega()
O.materials.append(ViscElMat(kn=4e4, ks=1.2e4, cn=600, cs=0, frictionAngle=math.atan(.4), density=1, label="m"))
for x, y in ((.24, .245), (.73, .26), (.25, .74), (.74, .745), (1.24, .25), (.5, 1.2)):
    b = utils.sphere((x, y, 0), .25, material="m"); O.bodies.append(b)
    b.state.mass = 75; b.state.inertia = Vector3(1, 1, 1) * .5 * 75 * .25**2; b.state.blockedDOFs = "zXY"; b.state.vel = (-.5, -.4, 0)
for centre, size in (((-.5, 2, 0), (.5, 5, 1)), ((2, -.5, 0), (5, .5, 1))):
    O.bodies.append(utils.box(centre, size, fixed=True, material="m"))
O.dt = 5e-4
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()], [Ip2_ViscElMat_ViscElMat_ViscElPhys()], [Law2_ScGeom_ViscElPhys_Basic()]),
    NewtonIntegrator(damping=0, gravity=(-2, -1.4, 0))]
bodies, rows = open("bodies.dump", "w"), open("contacts.csv", "w")
print("step,id1,id2,is_wall,fx,fy", file=rows)
for step in range(200):
    O.step()
    print(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n6\nITEM: BOX BOUNDS ff ff pp\n-9 9\n-9 9\n-1 1\nITEM: ATOMS id x y radius mass vx vy omegaz", file=bodies)
    for b in list(O.bodies)[:6]:
        s = b.state
        print(b.id + 1, repr(s.pos[0]), repr(s.pos[1]), .25, 75, repr(s.vel[0]), repr(s.vel[1]), repr(s.angVel[2]), file=bodies)
    for i in O.interactions:
        if i.isReal:
            f = i.phys.normalForce + i.phys.shearForce
            one, two = sorted((i.id1, i.id2)); sign = 1 if one == i.id1 else -1
            print(step, one + 1, two + 1 if two < 6 else two - 5, two > 5, sign * f[0], sign * f[1], sep=",", file=rows)
bodies.close(); rows.close()
