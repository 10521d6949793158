/* Replays what a planner in Python was told and given: a stream of doubles on stdin, its own commands on stdout. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ftqp.h"

enum { END, RESET, STEP, REPORT, WITHDRAW, STOP, RESUME, CARRY, TOOL, MOVE, SAID = 12, LOAD = 13, POSE = 16, NUMBERS = 29 };

static int get(double *numbers, size_t count) { return fread(numbers, sizeof *numbers, count, stdin) == count; }

static void put(const double *numbers, size_t count) { fwrite(numbers, sizeof *numbers, count, stdout); }

static unsigned char file[1 << 24];

int main(int count, char **arguments) {
    if (count < 2) return 2;
    FILE *in = fopen(arguments[1], "rb");
    if (in == NULL) return 2;
    const size_t bytes = fread(file, 1, sizeof file, in);
    fclose(in);
    size_t need;
    int code = ftqp_size(file, bytes, &need);
    if (code) return fprintf(stderr, "%s\n", ftqp_status_name(code)), 3;
    need = (need + FTQP_ALIGNMENT - 1) / FTQP_ALIGNMENT * FTQP_ALIGNMENT;
    ftqp *p = aligned_alloc(FTQP_ALIGNMENT, need);
    code = ftqp_open(p, file, bytes);
    if (code) return fprintf(stderr, "%s\n", ftqp_status_name(code)), 3;
    unsigned joints;
    memcpy(&joints, file + 40, sizeof joints);
    const size_t n = joints;
    double op, q[64], v[64], numbers[32];
    while (get(&op, 1) && op != END) {
        ftqp_target target;
        ftqp_fault fault;
        ftqp_load load;
        double answer;
        switch ((int)op) {
            case RESET:
                if (!get(q, n) || !get(v, n)) return 4;
                answer = ftqp_reset(p, q, v);
                if (answer > 0.0) answer = 0.0; /* a warning, which Python does not give */
                break;
            case STEP:
                if (!get(q, n) || !get(numbers, NUMBERS + 1)) return 4;
                memcpy(&target, numbers, sizeof target);
                answer = ftqp_step(p, q, NULL, &target, (int)numbers[NUMBERS]);
                break;
            case REPORT:
                if (!get(numbers, SAID)) return 4;
                fault.joint = (int)numbers[0], fault.kind = (int)numbers[1];
                fault.mode = (int)numbers[2], fault.reset = (int)numbers[3];
                memcpy(&fault.deceleration, numbers + 4, 8 * sizeof *numbers);
                answer = ftqp_report(p, &fault);
                break;
            case WITHDRAW:
                if (!get(numbers, 1)) return 4;
                answer = ftqp_withdraw(p, (int)numbers[0]);
                break;
            case STOP: answer = ftqp_stop(p); break;
            case RESUME: answer = ftqp_resume(p); break;
            case CARRY:
                if (!get(numbers, LOAD)) return 4;
                memcpy(&load, numbers, sizeof load);
                answer = ftqp_carry(p, load.mass > 0.0 ? &load : NULL);
                break;
            case TOOL:
                if (!get(numbers, POSE)) return 4;
                answer = ftqp_tool(p, numbers);
                break;
            case MOVE:
                if (!get(numbers, 1 + POSE + 6)) return 4;
                answer = ftqp_move(p, (int)numbers[0], numbers + 1, numbers + 1 + POSE);
                break;
            default: return 5;
        }
        put(&answer, 1);
        if ((int)op == STEP) {
            const double error = ftqp_error(p);
            put(ftqp_q(p), n), put(ftqp_v(p), n), put(ftqp_a(p), n), put(ftqp_tau(p), n), put(&error, 1);
        }
    }
    free(p);
    return 0;
}
