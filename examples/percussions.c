/* Percussions in a C program: two people press a third against a wall, without friction and with it.
 *
 *     NSCD=$(python -c "import nscd; print(nscd.__path__[0])")
 *     cc percussions.c -I$NSCD/core -L$NSCD -lnscd -Wl,-rpath,$NSCD
 */
#include <nscd.h>
#include <stdio.h>
#include <stdlib.h>

static void check(int sound) {
    if (!sound) {
        fprintf(stderr, "%s\n", nscd_message());
        exit(1);
    }
}

int main(void) {
    const double position[] = {0.25, 0.0, 0.75, 0.0, 1.2, 0.2};   /* m */
    const double velocity[] = {-1.0, 0.0, -1.0, 0.0, -1.0, -0.5}; /* m/s, before the impact */
    const double radius[] = {0.25, 0.25, 0.25};                   /* m */
    const double mass[] = {75.0, 80.0, 60.0};                     /* kg */

    for (double friction = 0.0; friction < 0.5; friction += 0.4) {
        nscd_crowd *crowd = nscd_new(3, position, velocity, radius, mass);
        check(crowd != NULL);
        check(nscd_friction(crowd, friction, NULL));
        check(nscd_contact(crowd, 0, -1, -1.0, 0.0)); /* the wall x = 0 */
        check(nscd_touch(crowd, 0.001));              /* everybody within 1 mm */
        check(nscd_solve(crowd, 1e-8));
        const double *percussion = nscd_percussions(crowd), *after = nscd_velocities(crowd);
        for (size_t c = 0; c < nscd_count(crowd); ++c) {
            ptrdiff_t first, second;
            nscd_pair(crowd, c, &first, &second);
            printf("%g %td %td %.17g %.17g\n", friction, first, second, percussion[2 * c], percussion[2 * c + 1]); /* N s */
        }
        for (int i = 0; i < 3; ++i) printf("%g %d %.17g %.17g\n", friction, i, after[2 * i], after[2 * i + 1]); /* m/s */
        nscd_free(crowd);
    }
    return 0;
}
