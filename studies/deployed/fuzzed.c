/* Changed files and calls out of order: numbers, never a crash. Arguments: arm.ftqp, how many files, a seed. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ftqp.h"

enum { HEAD = 128, RUNS_AT = 96 }; /* of a file: its head, and where that says how many runs follow */

static uint64_t state;

static uint64_t draw(uint64_t below) {
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return state % below;
}

static unsigned char whole[1 << 22], changed[(1 << 22) + 64];

static uint64_t fnv(const unsigned char *bytes, size_t count, uint64_t sum) {
    for (size_t k = 0; k < count; k++) sum = (sum ^ bytes[k]) * UINT64_C(0x100000001b3);
    return sum;
}

/* Make the checksum right again, so that what comes after it is looked at. */
static void seal(unsigned char *file, size_t bytes) {
    if (bytes < HEAD) return;
    const uint64_t sum = fnv(file + HEAD, bytes - HEAD, fnv(file, HEAD - 8, UINT64_C(0xcbf29ce484222325)));
    memcpy(file + HEAD - 8, &sum, sizeof sum);
}

/* Where a run's two words lie: those are changed under a seal, and not what the runs are filled with. */
static size_t place_of_run(const unsigned char *file, uint64_t wanted) {
    size_t at = HEAD;
    for (uint64_t run = 0; run < wanted; run++) {
        uint64_t count;
        memcpy(&count, file + at + 8, sizeof count);
        at += 16 + (size_t)count;
    }
    return at;
}

static double odd(void) {
    static const double numbers[] = {0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, -1e300};
    const uint64_t k = draw(10);
    return k < 7 ? numbers[k] : k == 7 ? (double)NAN : k == 8 ? (double)INFINITY : -(double)INFINITY;
}

static void any_calls(ftqp *p, int count) {
    double q[64], v[64];
    static char *search, *out;
    static size_t most;
    if (search == NULL) search = calloc(1, 64 + ftqp_search_size());
    if (out == NULL && ftqp_ways_size(p)) out = calloc(1, 64 + (most = ftqp_ways_size(p)));
    ftqp_search *s = (ftqp_search *)(((uintptr_t)search + 63) / 64 * 64);
    ftqp_ways *w = ftqp_ways_size(p) > most ? NULL : (ftqp_ways *)(((uintptr_t)out + 63) / 64 * 64);
    ftqp_way way;
    ftqp_target target;
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < 64; i++) q[i] = draw(4) ? 0.1 * (double)draw(20) - 1.0 : odd(), v[i] = odd();
        double *numbers = target.pose;
        memset(&target, 0, sizeof target);
        for (int i = 0; i < 16; i++) numbers[i] = draw(3) ? (i % 5 == 0) : odd();
        target.has_rotation = draw(4) ? 1.0 : odd();
        ftqp_fault fault = ftqp_fault_of((int)draw(70) - 2, (int)draw(6) - 1);
        if (!draw(2)) fault.deceleration = odd();
        if (!draw(2)) fault.velocity = odd();
        if (!draw(2)) fault.torque = odd();
        if (!draw(2)) fault.q_min = odd();
        if (!draw(2)) fault.q_max = odd();
        if (!draw(2)) fault.damping = odd();
        fault.mode = (int)draw(4) - 1, fault.reset = (int)draw(5) - 1;
        ftqp_load load = {odd(), {odd(), 0.0, 0.1}, {odd(), 0.0, 0.0, 0.0, odd(), 0.0, 0.0, 0.0, odd()}};
        double error[6];
        const int what = (int)draw(4) - 1;
        switch (draw(28)) {
            case 0: ftqp_reset(p, draw(9) ? q : NULL, draw(2) ? v : NULL); break;
            case 1: ftqp_report(p, draw(9) ? &fault : NULL); break;
            case 2: ftqp_withdraw(p, (int)draw(70) - 2); break;
            case 3: ftqp_stop(p); break;
            case 4: ftqp_resume(p); break;
            case 5: ftqp_speed(p, odd()); break;
            case 6: ftqp_carry(p, draw(3) ? &load : NULL); break;
            case 7: ftqp_detect(p, NULL, (int)draw(3)); break;
            case 8: ftqp_watch(p, draw(2) ? v : NULL); break;
            case 9: ftqp_tip(p, draw(2) ? numbers : NULL), ftqp_joints(p), ftqp_drive(p), (void)ftqp_dt(p); break;
            case 12: ftqp_tool(p, draw(3) ? numbers : NULL); break;
            case 13: ftqp_brake(p, (int)draw(70) - 2), ftqp_has(p, (int)draw(12) - 1), ftqp_believed(p, (int)draw(70) - 2); break;
            case 14: ftqp_aim(p, what, draw(9) ? &target : NULL), ftqp_task_error(p, what, draw(9) ? error : NULL); break;
            case 15: ftqp_aim_joints(p, what, draw(9) ? q : NULL), ftqp_weight(p, what, odd()); break;
            case 16: ftqp_move(p, what, draw(9) ? numbers : NULL, draw(2) ? v : NULL), (void)ftqp_clearance(p); break;
            case 11: ftqp_brakes(p, NULL), ftqp_stop_reason_name(ftqp_stop_reason(p)); break;
            case 17: draw(2) ? ftqp_go_to(p, draw(2) ? q : ftqp_q(p)) : ftqp_go_round(p, s, ftqp_q(p)), ftqp_arrived(p); break;
            case 18: {
                const int status = ftqp_go(p, draw(9) ? q : NULL, draw(2) ? v : NULL);
                const double *sent = ftqp_q(p);
                if (status >= 0 && (sent == NULL || !isfinite(sent[0]))) abort();
                break;
            }
            case 19: (draw(2) ? ftqp_go_to_pose(p, s, numbers) : ftqp_seek(p, draw(9) ? s : NULL, draw(9) ? numbers : NULL)); break;
            case 20: ftqp_find(draw(9) ? s : NULL, (int)draw(300), draw(9) ? q : NULL); break;
            case 21: ftqp_ways_out(p, draw(9) ? w : NULL, draw(2) ? q : ftqp_q(p)); break;
            case 22: for (int i = 0; i < 9; i++) ftqp_try(w, (int)draw(3000), draw(9) ? &way : NULL); break;
            case 23: ftqp_go_out(p, w, (int)draw(7) - 1); break;
            case 10: ftqp_follow(p, draw(2) ? q : NULL, v, (int)draw(4)), ftqp_begin(p), (void)ftqp_progress(p); break;
            default: {
                const int ticks = (int)draw(9) - 1;
                const int status = ftqp_step(p, draw(9) ? q : NULL, draw(2) ? v : NULL, draw(9) ? &target : NULL, ticks);
                const double *sent = ftqp_q(p);
                if (status >= 0 && (sent == NULL || !isfinite(sent[0]))) abort();
                (void)ftqp_tau(p);
            }
        }
    }
}

int main(int count, char **arguments) {
    if (count < 4) return 2;
    FILE *in = fopen(arguments[1], "rb");
    if (in == NULL) return 2;
    const size_t bytes = fread(whole, 1, sizeof whole, in);
    fclose(in);
    const long files = atol(arguments[2]);
    state = UINT64_C(88172645463325252) + (uint64_t)atol(arguments[3]);
    size_t need;
    if (ftqp_size(whole, bytes, &need)) return 3;
    need = (need + 63) / 64 * 64;
    ftqp *p = aligned_alloc(FTQP_ALIGNMENT, need);
    memset(p, 0, need);
    uint64_t runs;
    memcpy(&runs, whole + RUNS_AT, sizeof runs);
    long opened = 0;
    memcpy(changed, whole, bytes);
    for (long k = 0; k < files; k++) {
        size_t length = bytes, from = 0, places[8];
        const int sealed = (int)draw(2), edits = 1 + (int)draw(4);
        for (int e = 0; e < edits; e++) {
            const size_t at = sealed ? (draw(2) ? draw(HEAD - 8) : place_of_run(whole, draw(runs)) + draw(16)) : draw(bytes);
            changed[at] = draw(2) ? (unsigned char)draw(256) : (unsigned char)(changed[at] ^ (1u << draw(8)));
            places[from++] = at;
        }
        if (!draw(8)) length = draw(2) ? draw(bytes) : bytes + draw(64);
        if (sealed && length == bytes) seal(changed, length);
        size_t wanted = 0;
        const int code = ftqp_size(changed, length, &wanted);
        if (code == 0 && wanted <= need) opened += ftqp_open(p, changed, length) == 0;
        if (ftqp_open_for(p, changed, length, 0, 0) == 0) abort(); /* no arm has 0 joints */
        if (ftqp_status_name(code)[0] == 0) abort();
        while (from > 0) from--, changed[places[from]] = whole[places[from]];
        memcpy(changed + HEAD - 8, whole + HEAD - 8, 8);
    }
    memset(p, 0, need);
    any_calls(p, 1000);
    any_calls(NULL, 1000);
    if (ftqp_open(p, whole, bytes)) return 4;
    any_calls(p, (int)(files < 100000 ? files : 100000));
    for (int code = -1001; code < 50; code++)
        if (ftqp_status_name(code)[0] == 0) abort();
    printf("%ld changed files, %ld of them opened as nothing that counts was changed\n", files, opened);
    free(p);
    return 0;
}
