/* The end effector goes along a line while a joint locks half-way; then the others go home, as far as ftqp_go_to serves
   the arm. It follows its commands exactly. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arm.h"
#include "ftqp.h"

#ifdef FTQP_ARM_EMBEDDED
#define FILE_OF_ARM ftqp_arm_file
#define BYTES_OF_ARM sizeof ftqp_arm_file
static int read_arm(const char *path) { return (void)path, 0; }
#else
static unsigned char FILE_OF_ARM[1 << 24];
static size_t BYTES_OF_ARM;

static int read_arm(const char *path) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) return 1;
    BYTES_OF_ARM = fread(FILE_OF_ARM, 1, sizeof FILE_OF_ARM, file);
    return fclose(file);
}
#endif

enum { STEPS = 2000, LOCKS_AT = 1000, LOCKED = 2 };

static int failed(const char *what, int code) {
    fprintf(stderr, "%s: %s\n", what, ftqp_status_name(code));
    return EXIT_FAILURE;
}

int main(int count, char **arguments) {
    const char *path = count > 1 ? arguments[1] : "../arm.ftqp";
    size_t need;
    if (read_arm(path)) return fprintf(stderr, "%s cannot be read\n", path), EXIT_FAILURE;
    int code = ftqp_size(FILE_OF_ARM, BYTES_OF_ARM, &need);
    if (code) return failed("ftqp_size", code);
    need = (need + FTQP_ALIGNMENT - 1) / FTQP_ALIGNMENT * FTQP_ALIGNMENT;
    ftqp *p = aligned_alloc(FTQP_ALIGNMENT, need); /* once, before the loop */
    if (p == NULL) return fprintf(stderr, "no memory\n"), EXIT_FAILURE;
    code = ftqp_open_for(p, FILE_OF_ARM, BYTES_OF_ARM, FTQP_ARM_JOINTS, FTQP_ARM_FINGERPRINT);
    if (code) return failed("ftqp_open_for", code);

    double q[FTQP_ARM_JOINTS];
    memcpy(q, ftqp_arm_neutral, sizeof q);
    code = ftqp_reset(p, q, NULL);
    if (code) return failed("ftqp_reset", code);

    ftqp_target target;
    memcpy(target.pose, ftqp_arm_tip, sizeof target.pose); /* the pose at the neutral posture */
    memset(target.twist, 0, sizeof target.twist);
    memset(target.acceleration, 0, sizeof target.acceleration);
    target.has_rotation = FTQP_ARM_ROTATES;
    target.twist[0] = 0.02; /* 2 cm/s along x */

    double worst = 0.0;
    int brakes[FTQP_ARM_JOINTS];
    int counts[FTQP_HELD + 1] = {0};
    for (int k = 0; k < STEPS; k++) {
        if (k == LOCKS_AT && LOCKED < FTQP_ARM_JOINTS) {
            const ftqp_fault fault = ftqp_locked(LOCKED);
            code = ftqp_report(p, &fault);
            if (code) return failed("ftqp_report", code);
        }
        target.pose[3] = ftqp_arm_tip[3] + 0.02 * FTQP_ARM_DT * k;
        code = ftqp_step(p, q, NULL, &target, 1);
        if (code < 0) return failed("ftqp_step", code);
        counts[code]++;
        if (ftqp_brakes(p, brakes)) { /* joints out of hand: close their brakes before anything else */
            for (int i = 0; i < FTQP_ARM_JOINTS; i++)
                if (brakes[i]) fprintf(stderr, "close the brake of %s\n", ftqp_arm_joints[i]);
            return fprintf(stderr, "%s\n", ftqp_stop_reason_name(ftqp_stop_reason(p))), EXIT_FAILURE;
        }
        if (ftqp_error(p) > worst) worst = ftqp_error(p);
        memcpy(q, ftqp_q(p), sizeof q); /* to the drives, and back from the encoders */
    }
    printf("%d steps, worst error %.4f mm, %s locked half-way\n", STEPS, 1e3 * worst,
           LOCKED < FTQP_ARM_JOINTS ? ftqp_arm_joints[LOCKED] : "no joint");
    for (int status = 0; status <= FTQP_HELD; status++)
        if (counts[status]) printf("%6d  %s\n", counts[status], ftqp_status_name(status));
    if (ftqp_has(p, FTQP_HAS_GOALS)) {
        int periods = 0;
        code = ftqp_go_to(p, ftqp_arm_neutral);
        if (code) return failed("ftqp_go_to", code);
        do {
            code = ftqp_go(p, q, NULL);
            if (code < 0) return failed("ftqp_go", code);
            memcpy(q, ftqp_q(p), sizeof q);
        } while (ftqp_arrived(p) == FTQP_MOVING && ++periods < STEPS * 10);
        printf("home after %.2f s, %s\n", FTQP_ARM_DT * periods,
               ftqp_arrived(p) == FTQP_REACHED ? "all joints" : "but for joints that have failed");
    }
    free(p);
    return EXIT_SUCCESS;
}
