/* How long a step of an episode takes in C, with what it finds and does about that. Arguments: arm.ftqp, the episode: of
   each tick q, then a target, 29 numbers. Each tick counts with the least of its times in REPEATS runs. */
#include "times.h"

enum { REPEATS = 7, ROW = FTQP_ARM_JOINTS + 29, MOST = 100000 };

static double rows[MOST][ROW], took[MOST];

static double at_share(const double *times, long count, double share) {
    static double sorted[MOST];
    memcpy(sorted, times, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, compare);
    return sorted[(long)(share * (double)(count - 1))];
}

int main(int count, char **arguments) {
    if (count < 3) return 2;
    const size_t bytes = read_file(arguments[1], file, sizeof file);
    const long ticks = (long)(read_file(arguments[2], rows, sizeof rows) / sizeof rows[0]);
    size_t need;
    if (!ticks || ftqp_size(file, bytes, &need)) return 3;
    ftqp *p = aligned_alloc(64, (need + 63) / 64 * 64);
    long found = 0;
    for (int r = 0; r < REPEATS; r++) {
        if (ftqp_open(p, file, bytes) || ftqp_reset(p, rows[0], NULL)) return 4;
        for (long k = 0; k < ticks; k++) {
            ftqp_target target;
            memcpy(&target, rows[k] + FTQP_ARM_JOINTS, sizeof target);
            const double begin = now();
            ftqp_step(p, rows[k], NULL, &target, 1);
            const int news = ftqp_watch(p, NULL);
            const double time = now() - begin;
            took[k] = r == 0 || time < took[k] ? time : took[k];
            if (news == 2) found = k;
        }
    }
    if (!found) return 5;
    printf("{\"p50\": %.3f, \"p999\": %.3f, \"before\": %.3f, \"after\": %.3f, \"reaction\": %.3f}\n", at_share(took, ticks, 0.5),
           at_share(took, ticks, 0.999), at_share(took, found, 0.5), at_share(took + found + 1, ticks - found - 1, 0.5), took[found]);
    return 0;
}
