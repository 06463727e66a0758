/* Percussions of a snapshot of rigid disks, for programs in C and C++. SI units; the plane.
 *
 * Where a function fails it returns 0 (or a null pointer) and nscd_message() says why, in a line. A crowd belongs to one
 * thread at a time. Arrays are copied; (n, 2) are x0, y0, x1, y1, ...
 */
#ifndef NSCD_H
#define NSCD_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif
#if defined(__GNUC__)
#pragma GCC visibility push(default)
#endif

typedef struct nscd_crowd nscd_crowd;

/* n disks: centres (n, 2) m, left velocities u⁻ (n, 2) m/s, radii (n) m, masses (n) kg. nscd_free() returns them. */
nscd_crowd *nscd_new(size_t n, const double *position, const double *velocity, const double *radius, const double *mass);
void nscd_free(nscd_crowd *crowd);

/* Coulomb's friction at every contact, and spins (n) rad/s before the impact, null for none. Without a call: none. */
int nscd_friction(nscd_crowd *crowd, double coefficient, const double *spin);
/* Dissipation at every contact, k_n and k_t in kg (N s per m/s). Without a call: 0, a perfectly inelastic impact. */
int nscd_dissipation(nscd_crowd *crowd, double normal, double tangential);

/* A contact of two disks, with the normal of their centres; with an obstacle where second is -1, at the unit normal (x, y)
 * from the disk into it. One that was given before is refused. */
int nscd_contact(nscd_crowd *crowd, ptrdiff_t first, ptrdiff_t second, double x, double y);
/* All contacts of two disks whose gap is at most gap m. */
int nscd_touch(nscd_crowd *crowd, double gap);

/* Solve M(u⁺ - u⁻) + Dᵀp = 0 with the laws of contact. 1 where solved to the tolerance (1e-8 serves), relative to the largest
 * velocity; 0 where not: the best answer met then stands, and nscd_error() says how good it is. */
int nscd_solve(nscd_crowd *crowd, double tolerance);

/* Of the last answer: how many contacts; their disks, in the order of their making; percussions (k, 2) N s on the obstacle or
 * the second disk, first → second; right velocities u⁺ (n, 2) m/s; spins (n) rad/s. Valid until the next call that changes
 * the crowd. */
size_t nscd_count(const nscd_crowd *crowd);
void nscd_pair(const nscd_crowd *crowd, size_t contact, ptrdiff_t *first, ptrdiff_t *second);
const double *nscd_percussions(const nscd_crowd *crowd);
const double *nscd_velocities(const nscd_crowd *crowd);
const double *nscd_spins(const nscd_crowd *crowd);
/* The larger of the residual of the law and the error of momentum, dimensionless, recomputed from the answer. */
double nscd_error(const nscd_crowd *crowd);

/* Where people want to go who keep their distance, from the numbers that `percussions run` writes for its engines (drive.txt).
 * Velocities (n, 2) m/s of people at (n, 2) m of radii (n) m at a time (s); 0 where it failed. */
typedef struct nscd_drive nscd_drive;
nscd_drive *nscd_drive_new(const double *numbers, size_t count);
void nscd_drive_free(nscd_drive *drive);
int nscd_drive_desired(const nscd_drive *drive, size_t n, const double *position, const double *radius, double time, double *velocity);

/* Why the last call of this thread failed. */
const char *nscd_message(void);

#if defined(__GNUC__)
#pragma GCC visibility pop
#endif
#ifdef __cplusplus
}
#endif
#endif
