/* MuJoCo in the loop from C: servos take the planner's positions, a brake closes half-way.
   Arguments: model.xml, arm.ftqp, how many steps, the joint that brakes. Measured positions go to stdout. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "ftqp.h"

static unsigned char file[1 << 24];

int main(int count, char **arguments) {
    if (count < 5) return 2;
    char why[300];
    mjModel *m = mj_loadXML(arguments[1], NULL, why, sizeof why);
    if (m == NULL) return fprintf(stderr, "%s\n", why), 3;
    mjData *d = mj_makeData(m);
    FILE *in = fopen(arguments[2], "rb");
    if (in == NULL) return 2;
    const size_t bytes = fread(file, 1, sizeof file, in);
    fclose(in);
    const int steps = atoi(arguments[3]), brakes = atoi(arguments[4]);
    size_t need;
    if (ftqp_size(file, bytes, &need)) return 3;
    ftqp *p = aligned_alloc(FTQP_ALIGNMENT, (need + 63) / 64 * 64);
    ftqp_target target;
    if (ftqp_open(p, file, bytes)) return 3;
    if (fread(&target, sizeof target, 1, stdin) != 1) return 4;
    if (fread(d->qpos, sizeof *d->qpos, (size_t)m->nq, stdin) != (size_t)m->nq) return 4;
    ftqp_reset(p, d->qpos, NULL);
    const double x = target.pose[3];
    for (int k = 0; k < steps; k++) {
        if (k == steps / 2) {
            const ftqp_fault fault = ftqp_locked(brakes);
            m->dof_frictionloss[brakes] = 1e3; /* the brake itself */
            ftqp_report(p, &fault);
        }
        target.pose[3] = x + 0.02 * (1e-3 * k);
        ftqp_step(p, d->qpos, NULL, &target, 1);
        memcpy(d->ctrl, ftqp_q(p), (size_t)m->nu * sizeof *d->ctrl);
        mj_step(m, d);
        fwrite(d->qpos, sizeof *d->qpos, (size_t)m->nq, stdout);
    }
    free(p);
    mj_deleteData(d);
    mj_deleteModel(m);
    return 0;
}
