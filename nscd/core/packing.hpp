// Dense crowds before a door |y| < half_door in the wall x = 0: grown disk by disk, and pressed to the shut door.
#pragma once

#include "arrays.hpp"

namespace nscd {

// Lengths in one unit.
struct Growth {
    double half_door;
    double cell, reach;  // of the grid in which neighbours are found, and how far it reaches
    double typical;      // radius of the disk for which sites are looked for
    double reach_between;         // disks not farther from each other may have one that touches both between them
    double beside;       // disks not farther from the wall may have one that touches it and them
    double wall_distance;        // distance of a site from the wall, at least
    double hollow;       // distance of a site from the middle of the door, at least
    bool shut;           // whether a disk may rest on the door
};

// The first `placed` disks have their places (n·2) already; each other one goes to the free site nearest to the door where
// it touches two earlier ones, or one and the wall. Returns how many found a place.
int grow(Out position, In radius, int placed, const Growth& growth);

struct Press {
    double half_door;
    double stiffness;  // of the springs between disks that overlap
    double step;       // s, the first; the longest is `longest`
    double longest;
    double skin;       // pairs are listed again when a disk has moved half as far
    double cell;       // of the grid in which they are found, at least the largest diameter and the skin
    double force_tolerance;       // of the mean contact force: what a disk at rest may be off balance by
    int max_steps;          // steps
};
// Moves soft disks, each of unit mass, that are pushed to the door (n) until they rest; whether they do. Energy is minimised by
// FIRE (Bitzek et al., PRL 97, 2006, 170201).
bool press(Out position, In radius, In push, const Press& options);

}  // namespace nscd
