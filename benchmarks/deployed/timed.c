/* How long a step takes in C. Arguments: arm.ftqp, how many steps, fifo or free.
   free: one after the other; fifo: at 1 kHz under SCHED_FIFO with locked memory, asleep between steps. */
#include "times.h"

#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

enum { STACK = 1 << 20, WARM = 100, PAINT = 0x5a };

static ftqp *p;
static long steps;
static double *took;
static double half, third;

static void one_step(double *q, long k) {
    static ftqp_target target;
    if (k == 0) memcpy(target.pose, ftqp_arm_tip, sizeof target.pose);
    const double w = 1.5, t = FTQP_ARM_DT * (double)k;
    target.has_rotation = FTQP_ARM_ROTATES;
    target.pose[3] = ftqp_arm_tip[3] + 0.05 * (cos(w * t) - 1.0);
    target.pose[7] = ftqp_arm_tip[7] + 0.05 * sin(w * t);
    target.twist[0] = -0.05 * w * sin(w * t), target.twist[1] = 0.05 * w * cos(w * t);
    const double begin = now();
    ftqp_step(p, q, NULL, &target, 1);
    took[k] = now() - begin;
    memcpy(q, ftqp_q(p), FTQP_ARM_JOINTS * sizeof *q);
}

static void *deep(void *q) { /* on a painted stack: how deep the calls go */
    for (long k = 0; k < WARM; k++) {
        if (k == WARM / 2) {
            const ftqp_fault fault = ftqp_locked(1);
            ftqp_report(p, &fault);
        }
        one_step(q, k);
    }
    ftqp_withdraw(p, 1);
    return NULL;
}

int main(int count, char **arguments) {
    if (count < 4) return 2;
    const size_t bytes = read_file(arguments[1], file, sizeof file);
    steps = atol(arguments[2]);
    size_t need;
    if (ftqp_size(file, bytes, &need)) return 3;
    p = aligned_alloc(64, (need + 63) / 64 * 64);
    took = calloc((size_t)steps + WARM, sizeof *took);
    memset(took, 1, ((size_t)steps + WARM) * sizeof *took); /* so that its pages are there */
    double q[FTQP_ARM_JOINTS];
    memcpy(q, ftqp_arm_neutral, sizeof q);
    if (ftqp_open(p, file, bytes) || ftqp_reset(p, q, NULL)) return 3;

    unsigned char *stack = aligned_alloc(4096, STACK);
    memset(stack, PAINT, STACK);
    pthread_attr_t attributes;
    pthread_t thread;
    pthread_attr_init(&attributes);
    pthread_attr_setstack(&attributes, stack, STACK);
    if (pthread_create(&thread, &attributes, deep, q)) return 4;
    pthread_join(thread, NULL);
    size_t untouched = 0;
    while (untouched < STACK && stack[untouched] == PAINT) untouched++;

    memcpy(q, ftqp_arm_neutral, sizeof q);
    ftqp_reset(p, q, NULL);
    const int fifo = !strcmp(arguments[3], "fifo");
    if (fifo) {
        const struct sched_param priority = {.sched_priority = 80};
        if (mlockall(MCL_CURRENT | MCL_FUTURE)) perror("mlockall");
        if (sched_setscheduler(0, SCHED_FIFO, &priority)) perror("SCHED_FIFO");
    }
    for (long k = 0; k < WARM; k++) one_step(q, k);
    struct rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    struct timespec next;
    clock_gettime(CLOCK_MONOTONIC, &next);
    for (long k = WARM; k < steps; k++) {
        one_step(q, k);
        if (fifo) {
            next.tv_nsec += 1000000;
            if (next.tv_nsec >= 1000000000) next.tv_nsec -= 1000000000, next.tv_sec++;
            clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
        }
    }
    getrusage(RUSAGE_SELF, &after);
    const long n = steps - WARM;
    qsort(took + WARM, (size_t)n, sizeof *took, compare);
    half = took[WARM + n / 2], third = took[WARM + n * 999 / 1000];
    printf("{\"p50\": %.3f, \"p99\": %.3f, \"p999\": %.3f, \"max\": %.3f, \"page_faults\": %ld, \"stack\": %zu}\n", half,
           took[WARM + n * 99 / 100], third, took[WARM + n - 1], after.ru_minflt + after.ru_majflt - before.ru_minflt - before.ru_majflt,
           (size_t)STACK - untouched);
    return 0;
}
