/* ftqp.c - the C interface over the compiled kernel: checks, memory and the order of calls; no formula. */
#pragma GCC visibility push(default) /* what a shared library shows; all else is hidden */
#include "ftqp.h"
#pragma GCC visibility pop

#include <math.h>
#include <string.h>

#include "layout.h" /* made by ftqp build from the kernel's own layout */

#define MAGIC "FTQPARM"
#define OPEN UINT64_C(0x7166747071667470)
#define SEEKS UINT64_C(0x6b65657371747466)
#define LEADS UINT64_C(0x6461656c71747466)
#define TRIES UINT64_C(0x7365697271747466)
#define LINE(bytes) (((bytes) + 63u) & ~(uint64_t)63u)
#define AT(pointer) ((int64_t)(uintptr_t)(pointer))

enum { KERNEL_LOCKED = 1, KERNEL_SWINGS = 2, KERNEL_WORKS = 0, PARTS = 5, WORDS_OF_RUN = 2, NUMBERS = 29 };

_Static_assert(sizeof(ftqp_fault) == SIZE_OF_FAULT, "ftqp_fault is laid out as the kernel's");
_Static_assert(sizeof(ftqp_load) == SIZE_OF_LOAD, "ftqp_load is laid out as the kernel's");
_Static_assert(GOING_HALTED == FTQP_HALTED && GOING_UNREACHABLE == FTQP_UNREACHABLE, "ways have the kernel's numbers");
_Static_assert(FTQP_WAY_STOP == STOP_WAY && FTQP_WAY_HOME == HOME_WAY, "ways out have the kernel's numbers");
_Static_assert(sizeof(ftqp_way) == WAY_OUT_STAGE, "ftqp_way is laid out as the kernel's");
_Static_assert(TORQUE_DRIVE == FTQP_SENDS_TORQUES, "drives have the kernel's numbers");
_Static_assert(sizeof(ftqp_target) == NUMBERS * sizeof(double), "ftqp_target is a packed target");

int64_t KERNEL(deployed_step)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(believe)(int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(believed)(int64_t, int64_t);
int64_t KERNEL(respond)(int64_t, int64_t, int64_t);
int64_t KERNEL(forget_finding)(int64_t, int64_t);
int64_t KERNEL(sample_reserve)(int64_t, int64_t, int64_t);
int64_t KERNEL(count_on)(int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(hold_up)(int64_t, int64_t, int64_t);
int64_t KERNEL(start)(int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(stop)(int64_t, int64_t);
int64_t KERNEL(resume)(int64_t);
int64_t KERNEL(carry)(int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(torques)(int64_t);
int64_t KERNEL(ask_for_brake)(int64_t, int64_t);
int64_t KERNEL(hold)(int64_t, int64_t, int64_t);
int64_t KERNEL(begin_going)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(begin_going_to_pose)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(deployed_go)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(deployed_seek)(int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(find_posture)(int64_t, int64_t);
int64_t KERNEL(begin_way_out)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t,
                              int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(try_way_out)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(begin_way)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(remember)(int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(aim)(int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(aim_joints)(int64_t, int64_t, int64_t);
int64_t KERNEL(move_thing)(int64_t, int64_t, int64_t, int64_t);

_Static_assert(FTQP_FOUND_SENSOR_DROPPED == FOUND_SENSOR_DROPPED && FTQP_FOUND_LOCKED == FOUND_LOCKED, "as the kernel's");

#ifdef FTQP_WITH_PATH
int64_t KERNEL(deployed_follow)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);
int64_t KERNEL(begin_path)(int64_t);
#endif

/* What a file begins with; numbers are little-endian, as on every processor that is built for. */
typedef struct Head {
    char magic[8];
    uint32_t format, size;
    char kernel[24];
    uint32_t joints, samples;
    uint64_t record, given, arm, path, table, came_every, runs, bytes, fingerprint, checksum;
} Head;

/* What a planner begins with; behind it lie, each from a line of the cache on, the parts below. */
struct ftqp {
    uint64_t open;
    int32_t joints, samples, status;
    uint32_t noticed; /* what was found when ftqp_watch was asked last, as one number */
    uint64_t record, given, arm, path, table, table_bytes, free, going, led, rows, faults, came, work, bytes;
    ftqp_search *search; /* of the way that is gone, or NULL: it is straight */
    const ftqp *leader;  /* whose search it is: not that of a copy of the planner */
    double shares[2];
    int64_t kept[3]; /* of the way that is come: after how many ticks a place is, ticks, and places */
};

_Static_assert(sizeof(Head) == 128, "the head of a file has no gaps");

static void *part(const ftqp *p, uint64_t offset) { return (char *)(uintptr_t)p + offset; }

static double *field(const ftqp *p, uint64_t offset) { return (double *)part(p, p->record + offset); }

static int64_t whole(const ftqp *p, uint64_t part_of, uint64_t offset) {
    int64_t number;
    memcpy(&number, part(p, part_of + offset), sizeof number);
    return number;
}

static int is_open(const ftqp *p) {
    if (p == NULL) return FTQP_NULL;
    if ((uintptr_t)p % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    return p->open == OPEN ? 0 : FTQP_NOT_OPEN;
}

static uint64_t checksum_of(const unsigned char *bytes, size_t count, uint64_t sum) {
    for (size_t k = 0; k < count; k++) sum = (sum ^ bytes[k]) * UINT64_C(0x100000001b3);
    return sum;
}

/* The head of a file that is whole, or why it is not. */
static int read_head(const void *file, size_t bytes, Head *head) {
    if (file == NULL) return FTQP_NULL;
    if (bytes < sizeof *head) return bytes >= 8 && !memcmp(file, MAGIC, 8) ? FTQP_CUT_SHORT : FTQP_NO_FILE;
    memcpy(head, file, sizeof *head);
    if (memcmp(head->magic, MAGIC, 8)) return FTQP_NO_FILE;
    if (head->format != FORMAT || head->size != sizeof *head) return FTQP_OTHER_FORMAT;
    if (memcmp(head->kernel, KERNEL_HASH, sizeof head->kernel)) return FTQP_OTHER_KERNEL;
    if (head->bytes != bytes) return FTQP_CUT_SHORT;
    uint64_t sum = checksum_of(file, offsetof(Head, checksum), UINT64_C(0xcbf29ce484222325));
    sum = checksum_of((const unsigned char *)file + sizeof *head, bytes - sizeof *head, sum);
    if (sum != head->checksum) return FTQP_CHECKSUM;
    if (head->record != SIZE_OF_RECORD || head->given != SIZE_OF_GIVEN || head->arm != SIZE_OF_ARM)
        return FTQP_DAMAGED;
    if (head->came_every > INT32_MAX) return FTQP_DAMAGED;
    if (head->path != 0 && (head->path != SIZE_OF_PATH || !head->table)) return FTQP_DAMAGED;
    if (head->table % SIZE_OF_INTERVAL || head->table > bytes || (head->table && !head->path)) return FTQP_DAMAGED;
#ifndef FTQP_WITH_PATH
    if (head->path != 0) return FTQP_UNSUPPORTED;
#endif
    return head->joints < 1 || head->joints > CAPACITY || head->samples > MOST_SAMPLES ? FTQP_DAMAGED : 0;
}

/* Where the parts of a planner lie. */
static void arrange(ftqp *p, const Head *head) {
    const uint64_t n = head->joints, number = sizeof(double);
    p->joints = (int32_t)head->joints;
    p->samples = (int32_t)head->samples;
    p->record = LINE(sizeof *p);
    p->given = p->record + LINE(SIZE_OF_RECORD);
    p->arm = p->given + LINE(SIZE_OF_GIVEN);
    p->path = p->arm + LINE(SIZE_OF_ARM);
    p->table = p->path + LINE(head->path);
    p->table_bytes = head->table;
    p->free = p->table + LINE(head->table);
    p->going = p->free + LINE(SIZE_OF_FREE);
    p->led = p->going + LINE(SIZE_OF_GOING);
    p->rows = p->led + LINE(SIZE_OF_JOINTS);
    p->faults = p->rows + LINE(head->samples * n * (n + 3) * number);
    p->kept[0] = (int64_t)head->came_every;
    p->came = p->faults + LINE(n * sizeof(ftqp_fault));
    p->work = p->came + (head->came_every ? LINE(MOST_CAME * n * number) : 0);
    p->bytes = p->work + LINE((NUMBERS + 2 * n) * number);
}

int ftqp_size(const void *file, size_t bytes, size_t *need) {
    Head head;
    ftqp plan;
    if (need == NULL) return FTQP_NULL;
    *need = 0;
    const int code = read_head(file, bytes, &head);
    if (code) return code;
    arrange(&plan, &head);
    *need = (size_t)plan.bytes;
    return 0;
}

/* Fill record, given and arm from the runs of a file that are not zero, then the states of the samples. */
static int fill(ftqp *p, const unsigned char *file, const Head *head) {
    const uint64_t begins[PARTS] = {p->record, p->given, p->arm, p->path, p->table};
    const uint64_t sizes[PARTS] = {SIZE_OF_RECORD, SIZE_OF_GIVEN, SIZE_OF_ARM, head->path, head->table};
    const unsigned char *at = file + sizeof *head, *end = file + head->bytes;
    for (uint64_t run = 0; run < head->runs; run++) {
        uint64_t words[WORDS_OF_RUN];
        if ((uint64_t)(end - at) < sizeof words) return FTQP_DAMAGED;
        memcpy(words, at, sizeof words);
        at += sizeof words;
        const uint64_t which = words[0] >> 56, offset = words[0] & ((UINT64_C(1) << 56) - 1), count = words[1];
        if (which >= PARTS || offset > sizes[which] || count > sizes[which] - offset) return FTQP_DAMAGED;
        if (count > (uint64_t)(end - at)) return FTQP_DAMAGED;
        memcpy(part(p, begins[which] + offset), at, (size_t)count);
        at += count;
    }
    const uint64_t n = head->joints, states = 2 * n * sizeof(double);
    if ((uint64_t)(end - at) != head->samples * states) return FTQP_DAMAGED;
    for (uint64_t s = 0; s < head->samples; s++, at += states)
        memcpy(part(p, p->rows + s * n * (n + 3) * sizeof(double)), at, (size_t)states);
    return 0;
}

/* What is found now, as one number. */
static uint32_t findings(const ftqp *p) {
    uint32_t sum = 0;
    for (int i = 0; i < p->joints; i++) sum = sum * 31 + (uint32_t)whole(p, p->record, MONITOR_FOUND + 8 * (uint64_t)i);
    return sum;
}

/* What was found of a joint is forgotten: it is another's to say what becomes of it. */
static void forget(ftqp *p, int joint) {
    if (whole(p, p->record, MONITOR_NAMES)) KERNEL(forget_finding)(AT(part(p, p->record)), joint);
    p->noticed = findings(p);
}

/* Whether a chain has so many joints, each of which hangs on an earlier one. */
static int is_chain(const ftqp *p, uint64_t at) {
    const int64_t n = p->joints, tip = whole(p, at, IN_CHAIN_TIP_JOINT), floating = whole(p, at, IN_CHAIN_FLOATING);
    if (whole(p, at, IN_CHAIN_N) != n || tip < 0 || tip >= n || floating < 0 || floating > n) return 0;
    for (int64_t i = 0; i < n; i++) {
        const int64_t parent = whole(p, at, IN_CHAIN_PARENT + 8 * (uint64_t)i), lead = whole(p, at, IN_CHAIN_LEAD + 8 * (uint64_t)i);
        if (parent < -1 || parent >= i || lead < 0 || lead >= n) return 0;
    }
    return 1;
}

#if defined(FTQP_LEVEL) && defined(__x86_64__)
#include <cpuid.h>

/* Whether processor and system have the instructions of x86-64-v3 or v4. */
static int is_enough(void) {
    const unsigned fma = 1u << 12, saved = 1u << 27, avx2 = 1u << 5, bmi2 = 1u << 8, avx512 = 0xD0030000u;
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & (fma | saved)) != (fma | saved)) return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & (avx2 | bmi2)) != (avx2 | bmi2)) return 0;
    if ((low & 0x6u) != 0x6u) return 0;
    return FTQP_LEVEL < 4 || ((b & avx512) == avx512 && (low & 0xE6u) == 0xE6u);
}
#else
static int is_enough(void) { return 1; }
#endif

/* Whether tasks and things are as many as there is room for, and tasks are of joints that there are. */
static int is_furnished(const ftqp *p) {
    const int64_t tasks = whole(p, p->record, TERMS_OWN), things = whole(p, p->record, SCENE_OBSTACLES);
    if (tasks < 0 || tasks > MOST_TASKS || things < 0 || things > MOST_THINGS) return 0;
    for (int64_t t = 0; t < tasks; t++) {
        const uint64_t at = 8 * (uint64_t)t;
        const int64_t body = whole(p, p->record, TERMS_BODY + at), other = whole(p, p->record, TERMS_OTHER + at);
        if (body < -1 || body >= p->joints || other < -1 || other >= p->joints) return 0;
    }
    return 1;
}

int ftqp_open(ftqp *p, const void *file, size_t bytes) {
    Head head;
    if (p == NULL) return FTQP_NULL;
    if ((uintptr_t)p % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    if (!is_enough()) return FTQP_PROCESSOR;
    int code = read_head(file, bytes, &head);
    if (code) return code;
    memset(p, 0, sizeof *p);
    arrange(p, &head);
    memset(part(p, p->record), 0, (size_t)(p->bytes - p->record));
    code = fill(p, file, &head);
    if (code) return code;
    if (!is_chain(p, p->record + RECORD_CHAIN) || !is_chain(p, p->arm + ARM_CHAIN)) return FTQP_DAMAGED;
    if (!is_furnished(p) || whole(p, p->given, GIVEN_SAMPLES) != p->samples) return FTQP_DAMAGED;
    ftqp_fault *faults = part(p, p->faults);
    for (int i = 0; i < p->joints; i++) {
        faults[i] = ftqp_fault_of(i, KERNEL_WORKS);
    }
    if (p->samples && KERNEL(sample_reserve)(AT(part(p, p->arm)), AT(part(p, p->rows)), p->samples))
        return FTQP_INTERNAL;
    p->status = FTQP_NOT_RESET;
    p->open = OPEN;
    return 0;
}

int ftqp_open_for(ftqp *p, const void *file, size_t bytes, int joints, uint64_t fingerprint) {
    Head head;
    const int code = read_head(file, bytes, &head);
    if (code) return code;
    if ((uint32_t)joints != head.joints || fingerprint != head.fingerprint) return FTQP_OTHER_ARM;
    return ftqp_open(p, file, bytes);
}

/* What a search begins with; behind it lies its record. */
struct ftqp_search {
    uint64_t state; /* SEEKS of ftqp_find, LEADS of ftqp_go, or neither */
    int32_t joints;
};

enum { SEARCH = LINE(sizeof(ftqp_search)) };

static char *record_of(const ftqp_search *s) { return (char *)(uintptr_t)s + SEARCH; }

static int64_t number_of(const ftqp_search *s, uint64_t offset) {
    int64_t number;
    memcpy(&number, record_of(s) + offset, sizeof number);
    return number;
}

/* The joint whose motor moves joint i: itself, or the leader that it mimics. */
static int leader_of(const ftqp *p, int i) { return (int)whole(p, p->record, CHAIN_LEAD + 8 * (uint64_t)i); }

/* What a caller hands to a step, copied: it may be what the planner itself has handed out. */
typedef struct Inputs {
    double q[CAPACITY], v[CAPACITY];
    ftqp_target target;
} Inputs;

static void copy_inputs(const ftqp *p, Inputs *own, const double *q, const double *v, const ftqp_target *target) {
    const size_t bytes = (size_t)p->joints * sizeof(double);
    memset(own->v, 0, bytes);
    memcpy(own->q, q, bytes);
    if (v != NULL) memcpy(own->v, v, bytes);
    if (target != NULL) own->target = *target;
}

static int all_finite(const double *numbers, int count) {
    for (int k = 0; k < count; k++)
        if (!isfinite(numbers[k])) return 0;
    return 1;
}

/* Whether a healthy arm may be there, and as fast; who stands at the end of a range may be a little beyond. */
static int is_within(const ftqp *p, const double *q, const double *v) {
    const double *q_min = part(p, p->given + GIVEN_Q_MIN), *q_max = part(p, p->given + GIVEN_Q_MAX);
    const double *v_max = part(p, p->given + GIVEN_V_MAX);
    for (int i = 0; i < p->joints; i++)
        if (q[i] < q_min[i] - OUTSIDE_FROM || q[i] > q_max[i] + OUTSIDE_FROM ||
            (v != NULL && fabs(v[i]) > v_max[i] * (1.0 + OUTSIDE_FROM)))
            return 0;
    return 1;
}

/* After a tick, or its mistake: keep where the joints are commanded to be, when it is time. */
static void remember(ftqp *p, int64_t status) {
    if (p->kept[0]) KERNEL(remember)(AT(part(p, p->record)), AT(part(p, p->came)), MOST_CAME, AT(p->kept), status);
}

int ftqp_reset(ftqp *p, const double *q, const double *v) {
    const int code = is_open(p);
    if (code) return code;
    if (q == NULL) return FTQP_NULL;
    if (!all_finite(q, p->joints) || (v != NULL && !all_finite(v, p->joints))) return FTQP_NOT_FINITE;
    Inputs own;
    copy_inputs(p, &own, q, v, NULL);
    p->status = FTQP_NOT_RESET;
    *(int64_t *)part(p, p->going + GOING_TICKS) = -1; /* no motion goes on over a reset */
    if (p->table_bytes) ftqp_begin(p);
    const int64_t begun = KERNEL(start)(AT(part(p, p->record)), AT(part(p, p->given)), AT(own.q), AT(own.v));
    p->noticed = findings(p);
    p->kept[1] = p->kept[2] = 0;
    remember(p, 0);
    return begun < 0 || is_within(p, own.q, own.v) ? (int)begun : FTQP_BEYOND_LIMITS;
}

static void count_on(ftqp *p) {
    KERNEL(count_on)(AT(part(p, p->record)), AT(part(p, p->given)), AT(part(p, p->rows)), p->samples, AT(p->shares));
}

static int same_number(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

static int same(const ftqp_fault *a, const ftqp_fault *b) {
    return a->kind == b->kind && a->mode == b->mode && a->reset == b->reset &&
           same_number(a->deceleration, b->deceleration) && a->damping == b->damping &&
           a->friction == b->friction && a->velocity == b->velocity && a->acceleration == b->acceleration &&
           a->torque == b->torque && same_number(a->q_min, b->q_min) && same_number(a->q_max, b->q_max);
}

/* Believe what has been accepted: 0 where that was believed before. */
static int believe(ftqp *p, const ftqp_fault *fault) {
    ftqp_fault *now = (ftqp_fault *)part(p, p->faults) + fault->joint;
    if (same(fault, now)) return 0;
    const int64_t goes_on = now->kind == FTQP_LOCKED;
    ftqp_fault told = *fault;
    told.kind = fault->kind == FTQP_LOCKED          ? KERNEL_LOCKED
                : fault->kind == FTQP_FREE_SWINGING ? KERNEL_SWINGS
                                                    : KERNEL_WORKS;
    *now = *fault;
    KERNEL(believe)(AT(part(p, p->record)), AT(part(p, p->given)), AT(&told), goes_on);
    KERNEL(believed)(AT(part(p, p->record)), AT(part(p, p->given)));
    count_on(p);
    return 1;
}

/* The status of a step, after which what was found is counted on. */
static int responded(ftqp *p, int64_t status) {
    remember(p, status);
    if (status >= NEWS)
        for (int i = 0; i < p->joints; i++) {
            const int64_t becomes = KERNEL(respond)(AT(part(p, p->record)), AT(part(p, p->given)), i);
            if (becomes > KERNEL_SWINGS) continue;
            const ftqp_fault fault = ftqp_fault_of(i, (int)becomes);
            believe(p, &fault);
        }
    if (status >= 0) p->status = (int32_t)(status % NEWS);
    return status >= 0 ? p->status : (int)status;
}

int ftqp_step(ftqp *p, const double *q, const double *v, const ftqp_target *target, int ticks) {
    const int code = is_open(p);
    if (code) return code;
    if (q == NULL || target == NULL) return FTQP_NULL;
    if (ticks < 1) return FTQP_BAD_TICKS;
    Inputs own;
    copy_inputs(p, &own, q, v, target);
    return responded(p, KERNEL(deployed_step)(
        AT(part(p, p->record)), AT(part(p, p->given)), AT(part(p, p->free)), AT(own.q), AT(own.v), AT(&own.target), ticks,
        AT(part(p, p->work))));
}

static int is_share(double share) { return share > 0.0 && share <= 1.0; }

/* A fault as it is of the joint whose motor it concerns, as ftqp.faults.belief has it. */
static void to_leader(const ftqp *p, ftqp_fault *fault) {
    const int follower = fault->joint, leader = leader_of(p, follower);
    if (leader == follower) return;
    const double ratio = field(p, CHAIN_RATIO)[follower], offset = field(p, CHAIN_OFFSET)[follower];
    const double q_min = (fault->q_min - offset) / ratio, q_max = (fault->q_max - offset) / ratio;
    fault->joint = leader;
    fault->q_min = ratio > 0.0 ? q_min : q_max;
    fault->q_max = ratio > 0.0 ? q_max : q_min;
}

/* What is said of a fault of its kind, all else as of a healthy joint: 0, or why it is none. */
static int accepted(const ftqp *p, const ftqp_fault *told, ftqp_fault *fault) {
    if (told->joint < 0 || told->joint >= p->joints) return FTQP_NO_JOINT;
    ftqp_fault own = *told;
    to_leader(p, &own);
    const ftqp_fault *given = &own;
    if (given->joint < (int)whole(p, p->record, CHAIN_FLOATING)) return FTQP_NO_JOINT;
    *fault = ftqp_fault_of(given->joint, given->kind);
    if (given->kind == FTQP_LOCKED) {
        if (given->mode < FTQP_RAMP || given->mode > FTQP_INSTANT) return FTQP_BAD_FAULT;
        if (given->reset < FTQP_KINEMATIC || given->reset > FTQP_TASK) return FTQP_BAD_FAULT;
        if (!isnan(given->deceleration) && !(given->deceleration > 0.0 && isfinite(given->deceleration)))
            return FTQP_BAD_FAULT;
        fault->mode = given->mode;
        fault->reset = given->reset;
        fault->deceleration = given->deceleration;
        return 0;
    }
    if (given->kind == FTQP_FREE_SWINGING) {
        if (!(given->damping >= 0.0 && isfinite(given->damping))) return FTQP_BAD_FAULT;
        if (!(given->friction >= 0.0 && isfinite(given->friction))) return FTQP_BAD_FAULT;
        if (!whole(p, p->given, GIVEN_MAY_SWING)) return FTQP_UNSUPPORTED;
        fault->damping = given->damping;
        fault->friction = given->friction;
        return 0;
    }
    if (given->kind != FTQP_DEGRADED) return FTQP_BAD_FAULT;
    if (!is_share(given->velocity) || !is_share(given->acceleration) || !is_share(given->torque))
        return FTQP_BAD_FAULT;
    const double low = ((const double *)part(p, p->given + GIVEN_Q_MIN))[given->joint];
    const double high = ((const double *)part(p, p->given + GIVEN_Q_MAX))[given->joint];
    const double least = isnan(given->q_min) ? low : fmax(given->q_min, low);
    const double most = isnan(given->q_max) ? high : fmin(given->q_max, high);
    if (!(least < most)) return FTQP_BAD_FAULT;
    fault->velocity = given->velocity;
    fault->acceleration = given->acceleration;
    fault->torque = given->torque;
    fault->q_min = given->q_min;
    fault->q_max = given->q_max;
    return 0;
}

int ftqp_report(ftqp *p, const ftqp_fault *fault) {
    ftqp_fault told;
    int code = is_open(p);
    if (code) return code;
    if (fault == NULL) return FTQP_NULL;
    code = accepted(p, fault, &told);
    if (code) return code;
    const int news = believe(p, &told);
    forget(p, told.joint);
    if (news && told.torque < 1.0 && whole(p, p->record, CHAIN_HAS_INERTIA))
        KERNEL(hold_up)(AT(part(p, p->record)), AT(part(p, p->arm)), told.joint);
    return 0;
}

int ftqp_withdraw(ftqp *p, int joint) {
    const int code = is_open(p);
    if (code) return code;
    if (joint < 0 || joint >= p->joints) return FTQP_NO_JOINT;
    const int leader = leader_of(p, joint);
    const ftqp_fault healthy = ftqp_fault_of(leader, KERNEL_WORKS);
    believe(p, &healthy);
    forget(p, leader);
    return 0;
}

int ftqp_believed(const ftqp *p, int joint) {
    const int code = is_open(p);
    if (code) return code;
    if (joint < 0 || joint >= p->joints) return FTQP_NO_JOINT;
    return ((const ftqp_fault *)part(p, p->faults))[leader_of(p, joint)].kind;
}

int ftqp_stop(ftqp *p) {
    const int code = is_open(p);
    return code ? code : (int)KERNEL(stop)(AT(part(p, p->record)), STOPPED_AS_ASKED);
}

int ftqp_resume(ftqp *p) {
    const int code = is_open(p);
    if (code) return code;
    const int released = (int)KERNEL(resume)(AT(part(p, p->record)));
    return released;
}

int ftqp_speed(ftqp *p, double share) {
    const int code = is_open(p);
    if (code) return code;
    if (!p->table_bytes) return FTQP_UNSUPPORTED;
    if (!(share > 0.0 && share <= 1.0)) return FTQP_BAD_SPEED;
    *field(p, FEEDBACK_SPEED) = share;
    return 0;
}

/* Whether nothing is kept that a straight way to a posture might come too near to. */
static int may_go(const ftqp *p) { return !whole(p, p->record, SCENE_PAIRS) && !whole(p, p->record, KEEPS_ASKED); }

size_t ftqp_search_size(void) { return SEARCH + SIZE_OF_WAYS; }

/* What the kernel says of numbers that it was told. */
static int told(int64_t code) {
    const int said[] = {0, FTQP_NO_POSE, FTQP_UNSUPPORTED, FTQP_NO_POSTURE};
    return code < 0 || code > 3 ? FTQP_INTERNAL : said[code];
}

/* What is copied into a search from its planner: each row an address, one to copy from, and how many words. */
enum { COPIES = 3 };

static void list_copies(const ftqp *p, const ftqp_search *s, int64_t copies[COPIES][3]) {
    const uint64_t to[] = {SEARCH_CHAIN, SEARCH_SCENE, SEARCH_KEEPS}, from[] = {RECORD_CHAIN, RECORD_SCENE, RECORD_KEEPS};
    const int64_t sizes[] = {SIZE_OF_CHAIN, SIZE_OF_SCENE, SIZE_OF_KEEPS};
    for (int k = 0; k < COPIES; k++) {
        copies[k][0] = AT(record_of(s) + to[k]);
        copies[k][1] = AT(part(p, p->record + from[k]));
        copies[k][2] = sizes[k] / (int64_t)sizeof(int64_t);
    }
}

/* Clear a search but for trees and motions, which are written before they are read: 0, or a mistake. */
static int clear(const ftqp *p, ftqp_search *s) {
    const int code = is_open(p);
    if (code) return code;
    if (s == NULL) return FTQP_NULL;
    if ((uintptr_t)s % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    memset(s, 0, sizeof *s);
    memset(record_of(s), 0, SEARCH_NODE);
    memset(record_of(s) + SEARCH_NORMAL, 0, SEARCH_C - SEARCH_NORMAL);
    memset(record_of(s) + SEARCH_CHAIN, 0, SIZE_OF_WAYS - SEARCH_CHAIN);
    s->joints = p->joints;
    return 0;
}

int ftqp_seek(const ftqp *p, ftqp_search *s, const double *pose) {
    if (p != NULL && pose == NULL) return FTQP_NULL;
    const int code = clear(p, s);
    if (code) return code;
    if (!whole(p, p->record, STATE_IS_RESET)) return FTQP_NOT_RESET;
    double own[16];
    int64_t copies[COPIES][3];
    memcpy(own, pose, sizeof own);
    list_copies(p, s, copies);
    for (int k = 0; k < COPIES; k++) memcpy((void *)(uintptr_t)copies[k][0], (const void *)(uintptr_t)copies[k][1], 8 * (size_t)copies[k][2]);
    const int begun = told(KERNEL(deployed_seek)(AT(record_of(s)), AT(part(p, p->record)), AT(part(p, p->given)), AT(own)));
    s->state = begun ? 0 : SEEKS;
    return begun;
}

int ftqp_find(ftqp_search *s, int looks, double *q) {
    if (s == NULL || q == NULL) return FTQP_NULL;
    if ((uintptr_t)s % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    if (s->state != SEEKS) return FTQP_NO_GOAL;
    if (looks < 1) return FTQP_BAD_TICKS;
    if (KERNEL(find_posture)(AT(record_of(s)), looks)) {
        memcpy(q, record_of(s) + SEARCH_DRAWN, (size_t)s->joints * sizeof *q);
        return 1;
    }
    return number_of(s, SEARCH_STARTS) < number_of(s, SEARCH_MOST_STARTS) ? 0 : FTQP_NO_POSTURE;
}

/* Whether a posture was given. */
static int has_goal(const ftqp *p) { return *(const double *)part(p, p->going + GOING_TOLERANCE) > 0.0; }

/* Let the way be that of a search from now on, or straight where it is NULL. */
static void lead_by(ftqp *p, ftqp_search *s) {
    p->search = s;
    p->leader = p;
    if (s != NULL) s->state = LEADS;
}

/* Go to a posture, straight without a search. */
static int go(ftqp *p, ftqp_search *s, const double *q) {
    if (q == NULL) return FTQP_NULL;
    const double *q_min = part(p, p->given + GIVEN_Q_MIN), *q_max = part(p, p->given + GIVEN_Q_MAX);
    for (int i = 0; i < p->joints; i++)
        if (!(isfinite(q[i]) && q[i] >= q_min[i] && q[i] <= q_max[i])) return FTQP_NO_POSTURE;
    Inputs own;
    copy_inputs(p, &own, q, NULL, NULL);
    KERNEL(begin_going)
    (AT(part(p, p->record)), AT(part(p, p->given)), AT(part(p, p->going)), AT(part(p, p->led)),
     s == NULL ? 0 : AT(record_of(s)), s != NULL, AT(own.q));
    lead_by(p, s);
    return 0;
}

int ftqp_go_to(ftqp *p, const double *q) {
    const int code = is_open(p);
    if (code) return code;
    return may_go(p) ? go(p, NULL, q) : q == NULL ? FTQP_NULL : FTQP_UNSUPPORTED;
}

int ftqp_go_round(ftqp *p, ftqp_search *s, const double *q) {
    const int code = clear(p, s);
    return code ? code : go(p, s, q);
}

int ftqp_go_to_pose(ftqp *p, ftqp_search *s, const double *pose) {
    if (p != NULL && pose == NULL) return FTQP_NULL;
    const int code = clear(p, s);
    if (code) return code;
    double own[16];
    memcpy(own, pose, sizeof own);
    const int begun = told(KERNEL(begin_going_to_pose)(AT(part(p, p->record)), AT(part(p, p->given)), AT(part(p, p->going)),
                                                       AT(part(p, p->led)), AT(record_of(s)), AT(own)));
    if (!begun) lead_by(p, s);
    return begun;
}

int ftqp_go(ftqp *p, const double *q, const double *v) {
    int64_t copies[COPIES][3];
    const int code = is_open(p);
    if (code) return code;
    if (q == NULL) return FTQP_NULL;
    const ftqp_search *s = p->search;
    if (!has_goal(p) || (s != NULL && (p->leader != p || s->state != LEADS))) return FTQP_NO_GOAL;
    Inputs own;
    copy_inputs(p, &own, q, v, NULL);
    if (s != NULL) list_copies(p, s, copies);
    return responded(p, KERNEL(deployed_go)(AT(part(p, p->record)), AT(part(p, p->arm)), AT(part(p, p->going)),
                                            AT(part(p, p->led)), s == NULL ? 0 : AT(record_of(s)), AT(copies),
                                            s == NULL ? 0 : COPIES, AT(own.q), AT(own.v)));
}

/* What ways out begin with; behind it lie the search that leads, the ways, and two copies of the planner. */
struct ftqp_ways {
    uint64_t state; /* TRIES */
    int32_t joints, kind, fewer, begun, has_home;
    uint64_t ways, model, twin, bytes;
    double home[CAPACITY];
    int32_t brakes[CAPACITY]; /* of joints that hang at rest, which are closed first */
};

enum { WAYS_SEARCH = LINE(sizeof(ftqp_ways)), WAYS_OUT = FTQP_WAY_STOP + 1 };

static ftqp_search *search_of(const ftqp_ways *w) { return (ftqp_search *)((char *)(uintptr_t)w + WAYS_SEARCH); }

static char *way_of(const ftqp_ways *w, int kind) { return (char *)(uintptr_t)w + w->ways + (uint64_t)kind * LINE(SIZE_OF_WAY_OUT); }

static ftqp *copy_in(const ftqp_ways *w, uint64_t at) { return (ftqp *)((char *)(uintptr_t)w + at); }

static int64_t places_of(const ftqp_ways *w, int kind) {
    int64_t places;
    memcpy(&places, way_of(w, kind) + WAY_OUT_PLACES, sizeof places);
    return places;
}

/* Where its parts lie, for a planner of so many bytes. */
static void arrange_ways(ftqp_ways *w, uint64_t bytes) {
    w->ways = WAYS_SEARCH + LINE(SEARCH + SIZE_OF_WAYS);
    w->model = w->ways + WAYS_OUT * LINE(SIZE_OF_WAY_OUT);
    w->twin = w->model + bytes;
    w->bytes = w->twin + bytes;
}

size_t ftqp_ways_size(const ftqp *p) {
    ftqp_ways plan;
    if (is_open(p)) return 0;
    arrange_ways(&plan, p->bytes);
    return (size_t)plan.bytes;
}

/* Whether a joint that is believed to swing freely hangs at rest, as all such do, beside a brake of its own. */
static int hangs(const ftqp *p, int joint) {
    for (int i = 0; i < p->joints; i++)
        if (ftqp_believed(p, i) == FTQP_FREE_SWINGING && !(fabs(field(p, STATE_V_COMMAND)[i]) < HANGS)) return 0;
    return whole(p, p->record, FEEDBACK_BRAKES) == EACH_BRAKES &&
           ((const ftqp_fault *)part(p, p->faults))[joint].kind == FTQP_FREE_SWINGING;
}

int ftqp_ways_out(const ftqp *p, ftqp_ways *w, const double *home) {
    const int code = is_open(p);
    if (code) return code;
    if (w == NULL) return FTQP_NULL;
    if ((uintptr_t)w % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    if (whole(p, p->record, CHAIN_FLOATING)) return FTQP_UNSUPPORTED;
    if (!whole(p, p->record, STATE_IS_RESET)) return FTQP_NOT_RESET;
    if (home != NULL && !all_finite(home, p->joints)) return FTQP_NO_POSTURE;
    memset(w, 0, sizeof *w);
    arrange_ways(w, p->bytes);
    w->joints = p->joints;
    w->has_home = home != NULL;
    if (home != NULL) memcpy(w->home, home, (size_t)p->joints * sizeof *home);
    memset(way_of(w, 0), 0, WAYS_OUT * LINE(SIZE_OF_WAY_OUT));
    search_of(w)->state = 0;
    ftqp *model = copy_in(w, w->model);
    memcpy(model, p, (size_t)p->bytes);
    for (int i = 0; i < p->joints; i++) w->brakes[i] = hangs(p, i);
    for (int i = 0; i < p->joints; i++)
        if (w->brakes[i]) ftqp_brake(model, i);
    w->state = TRIES;
    return 0;
}

/* Begin with the next way: whether there is one, as far as is known. */
static int begin_next(ftqp_ways *w, ftqp *twin) {
    int64_t copies[COPIES][3];
    ftqp *model = copy_in(w, w->model);
    ftqp_search *s = search_of(w);
    if (w->kind == FTQP_WAY_HOME && !w->has_home) return 0;
    if (w->kind <= FTQP_WAY_BACK_BY_TIP && model->kept[2] < 2) return 0;
    memcpy(twin, model, (size_t)model->bytes);
    clear(twin, s);
    list_copies(twin, s, copies);
    return (int)KERNEL(begin_way_out)(AT(part(twin, twin->record)), AT(part(twin, twin->given)), AT(part(twin, twin->going)),
                                      AT(part(twin, twin->led)), AT(record_of(s)), AT(copies), COPIES, AT(way_of(w, w->kind)),
                                      AT(part(twin, twin->came)), MOST_CAME, twin->kept[2], AT(w->home), w->kind, w->fewer);
}

int ftqp_try(ftqp_ways *w, int looks, ftqp_way *out) {
    int64_t copies[COPIES][3];
    if (w == NULL || out == NULL) return FTQP_NULL;
    if ((uintptr_t)w % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    if (w->state != TRIES) return FTQP_NO_GOAL;
    if (looks < 1) return FTQP_BAD_TICKS;
    if (w->kind > FTQP_WAY_STOP) return FTQP_NO_WAY;
    ftqp *model = copy_in(w, w->model), *twin = copy_in(w, w->twin);
    ftqp_search *s = search_of(w);
    if (!w->begun && begin_next(w, twin)) {
        w->begun = 1;
        return 0;
    }
    if (w->begun) {
        list_copies(twin, s, copies);
        if (!KERNEL(try_way_out)(AT(part(twin, twin->record)), AT(part(twin, twin->given)), AT(part(twin, twin->arm)),
                                 AT(part(twin, twin->going)), AT(part(twin, twin->led)), AT(record_of(s)), AT(copies), COPIES,
                                 AT(way_of(w, w->kind)), looks))
            return 0;
        memcpy(out, way_of(w, w->kind), sizeof *out);
    }
    const int found = w->begun && places_of(w, w->kind);
    const int more = w->kind == FTQP_WAY_BACK_BY_TIP && w->fewer < (int)whole(model, model->record, TASK_SETS);
    w->fewer = w->begun && more && !(found && out->clear) ? w->fewer + 1 : 0;
    if (!w->fewer) w->kind++;
    w->begun = 0;
    return found;
}

int ftqp_go_out(ftqp *p, ftqp_ways *w, int kind) {
    int code = is_open(p);
    if (code) return code;
    if (w == NULL) return FTQP_NULL;
    if ((uintptr_t)w % FTQP_ALIGNMENT) return FTQP_MISALIGNED;
    if (w->state != TRIES || w->joints != p->joints) return FTQP_NO_GOAL;
    if (kind < 0 || kind > FTQP_WAY_STOP || !places_of(w, kind)) return FTQP_NO_WAY;
    for (int i = 0; i < p->joints; i++)
        if (w->brakes[i] && ((const ftqp_fault *)part(p, p->faults))[i].kind == FTQP_FREE_SWINGING) ftqp_brake(p, i);
    ftqp_search *s = search_of(w);
    w->kind = WAYS_OUT; /* the search leads from now on */
    code = clear(p, s);
    if (code) return code;
    KERNEL(begin_way)(AT(part(p, p->record)), AT(part(p, p->given)), AT(part(p, p->going)), AT(part(p, p->led)),
                      AT(record_of(s)), AT(way_of(w, kind)));
    lead_by(p, s);
    return 0;
}

int ftqp_arrived(const ftqp *p) {
    const int code = is_open(p);
    if (code) return code;
    return has_goal(p) ? (int)whole(p, p->going, GOING_STATE) : FTQP_NO_GOAL;
}

int ftqp_follow(ftqp *p, const double *q, const double *v, int ticks) {
    const int code = is_open(p);
    if (code) return code;
    if (!p->table_bytes) return FTQP_UNSUPPORTED;
    if (q == NULL) return FTQP_NULL;
    if (ticks < 1) return FTQP_BAD_TICKS;
#ifdef FTQP_WITH_PATH
    Inputs own;
    copy_inputs(p, &own, q, v, NULL);
    return responded(p, KERNEL(deployed_follow)(
        AT(part(p, p->record)), AT(part(p, p->given)), AT(part(p, p->free)), AT(part(p, p->path)), AT(part(p, p->table)),
        (int64_t)(p->table_bytes / SIZE_OF_INTERVAL), AT(own.q), AT(own.v), ticks, AT(part(p, p->work))));
#else
    (void)v;
    return FTQP_UNSUPPORTED;
#endif
}

double ftqp_progress(const ftqp *p) {
    if (is_open(p) || !p->table_bytes) return (double)NAN;
    return *(const double *)part(p, p->path + PATH_PROGRESS);
}

int ftqp_begin(ftqp *p) {
    const int code = is_open(p);
    if (code) return code;
    if (!p->table_bytes) return FTQP_UNSUPPORTED;
#ifdef FTQP_WITH_PATH
    KERNEL(begin_path)(AT(part(p, p->path)));
#endif
    return 0;
}

/* Whether a rigid body can have the inertia: symmetric, no principal moment below 0 or above the sum of the others.
   That is: the matrix of second moments, half its trace times 1 less itself, is positive semidefinite. */
static int is_body(const ftqp_load *load) {
    const double heaviest = 1e6, farthest = 1e3; /* kg, m: as ftqp.Payload has it */
    const double *I = load->inertia;
    double most = 0.0;
    if (!(load->mass > 0.0) || !isfinite(load->mass) || !all_finite(load->com, 3) || !all_finite(I, 9)) return 0;
    for (int k = 0; k < 9; k++) most = fmax(most, fabs(I[k]));
    if (load->mass > heaviest || most > heaviest * farthest * farthest) return 0;
    for (int k = 0; k < 3; k++)
        if (fabs(load->com[k]) > farthest) return 0;
    const double slack = 1e-9 * most;
    if (fabs(I[1] - I[3]) > slack || fabs(I[2] - I[6]) > slack || fabs(I[5] - I[7]) > slack) return 0;
    const double half = 0.5 * (I[0] + I[4] + I[8]) + slack;
    const double a = half - I[0], b = half - I[4], c = half - I[8], d = -I[1], e = -I[2], f = -I[5];
    const double minors = fmin(a * b - d * d, fmin(a * c - e * e, b * c - f * f));
    const double all = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e);
    return fmin(a, fmin(b, c)) >= 0.0 && minors >= -slack * most && all >= -slack * most * most;
}

int ftqp_carry(ftqp *p, const ftqp_load *load) {
    const ftqp_load nothing = {0.0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}};
    const int code = is_open(p);
    if (code) return code;
    if (load != NULL && !whole(p, p->record, CHAIN_HAS_INERTIA)) return FTQP_UNSUPPORTED;
    if (load != NULL && !is_body(load)) return FTQP_BAD_LOAD;
    const ftqp_load told = load == NULL ? nothing : *load;
    KERNEL(carry)(AT(part(p, p->record)), AT(part(p, p->arm)), AT(part(p, p->given)), AT(&told));
    if (p->samples) KERNEL(sample_reserve)(AT(part(p, p->arm)), AT(part(p, p->rows)), p->samples);
    count_on(p);
    return 0;
}

int ftqp_tool(ftqp *p, const double *T) {
    const double none[16] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    const int code = is_open(p);
    return code ? code : told(KERNEL(hold)(AT(part(p, p->record)), AT(part(p, p->given)), AT(T == NULL ? none : T)));
}

int ftqp_brake(ftqp *p, int joint) {
    const int code = is_open(p);
    if (code) return code;
    if (joint < 0 || joint >= p->joints) return FTQP_NO_JOINT;
    if (((const ftqp_fault *)part(p, p->faults))[joint].kind != FTQP_FREE_SWINGING) return FTQP_NOT_FREE;
    ftqp_fault stands = ftqp_locked(joint);
    stands.mode = FTQP_INSTANT;
    KERNEL(ask_for_brake)(AT(part(p, p->record)), joint);
    return ftqp_report(p, &stands);
}

int ftqp_has(const ftqp *p, int what) {
    const int code = is_open(p);
    if (code) return code;
    switch (what) {
        case FTQP_HAS_DETECTOR: return whole(p, p->record, MONITOR_NAMES) != 0;
        case FTQP_HAS_PATH: return p->table_bytes != 0;
        case FTQP_HAS_TASKS: return whole(p, p->record, TERMS_OWN) != 0;
        case FTQP_HAS_THINGS: return whole(p, p->record, SCENE_OBSTACLES) != 0;
        case FTQP_HAS_MASSES: return whole(p, p->record, CHAIN_HAS_INERTIA) != 0;
        case FTQP_HAS_FREE_JOINTS: return whole(p, p->given, GIVEN_MAY_SWING) != 0;
        case FTQP_HAS_GOALS: return may_go(p);
        case FTQP_HAS_WAYS_OUT: return !whole(p, p->record, CHAIN_FLOATING);
        case FTQP_HAS_WAY_BACK: return !whole(p, p->record, CHAIN_FLOATING) && p->kept[0];
        default: return FTQP_UNSUPPORTED;
    }
}

int ftqp_tasks(const ftqp *p) {
    const int code = is_open(p);
    return code ? code : (int)whole(p, p->record, TERMS_OWN);
}

/* 0 where the planner has such a task. */
static int is_task(const ftqp *p, int task) {
    const int count = ftqp_tasks(p);
    return count < 0 ? count : task < 0 || task >= count ? FTQP_NO_TASK : 0;
}

int ftqp_aim(ftqp *p, int task, const ftqp_target *target) {
    const int code = is_task(p, task);
    if (code) return code;
    if (target == NULL) return FTQP_NULL;
    return told(KERNEL(aim)(AT(part(p, p->record)), AT(part(p, p->given)), task, AT(target)));
}

int ftqp_aim_joints(ftqp *p, int task, const double *q) {
    const int code = is_task(p, task);
    if (code) return code;
    if (q == NULL) return FTQP_NULL;
    return told(KERNEL(aim_joints)(AT(part(p, p->record)), task, AT(q)));
}

int ftqp_weight(ftqp *p, int task, double weight) {
    const int code = is_task(p, task);
    if (code) return code;
    const int is_equation = whole(p, p->record, TERMS_HARD + 8 * (uint64_t)task) != 0;
    if (!(weight >= 0.0 && isfinite(weight)) || (is_equation && weight > 0.0 && weight != 1.0)) return FTQP_BAD_WEIGHT;
    field(p, TERMS_WEIGHT)[task] = weight;
    return 0;
}

int ftqp_task_error(const ftqp *p, int task, double *error) {
    const int code = is_task(p, task);
    if (code) return code;
    if (error == NULL) return FTQP_NULL;
    if (p->status < 0) return FTQP_NOT_RESET;
    if (whole(p, p->record, TERMS_KIND + 8 * (uint64_t)task) == JOINT_PLACES) return FTQP_UNSUPPORTED;
    memcpy(error, field(p, TERMS_ERROR) + 6 * task, 6 * sizeof *error);
    return 0;
}

int ftqp_things(const ftqp *p) {
    const int code = is_open(p);
    return code ? code : (int)whole(p, p->record, SCENE_OBSTACLES);
}

int ftqp_move(ftqp *p, int thing, const double *pose, const double *twist) {
    const double none[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    const int count = ftqp_things(p);
    if (count < 0) return count;
    if (thing < 0 || thing >= count) return FTQP_NO_THING;
    if (pose == NULL) return FTQP_NULL;
    return told(KERNEL(move_thing)(AT(part(p, p->record)), thing, AT(pose), AT(twist == NULL ? none : twist)));
}

double ftqp_clearance(const ftqp *p) {
    return is_open(p) || p->status < 0 || !whole(p, p->record, SCENE_PAIRS) ? (double)NAN : *field(p, SCENE_DISTANCE);
}

const double *ftqp_q(const ftqp *p) { return is_open(p) ? NULL : field(p, FEEDBACK_Q_SENT); }

const double *ftqp_v(const ftqp *p) { return is_open(p) ? NULL : field(p, FEEDBACK_V_SENT); }

const double *ftqp_a(const ftqp *p) { return is_open(p) ? NULL : field(p, STATE_A_COMMAND); }

const double *ftqp_tau(const ftqp *p) {
    if (is_open(p)) return NULL;
    if (whole(p, p->record, FEEDBACK_KIND) == TORQUE_DRIVE) return field(p, FEEDBACK_TAU_SENT);
    if (!whole(p, p->record, CHAIN_HAS_INERTIA))
        for (int i = 0; i < p->joints; i++) field(p, STATE_TAU)[i] = NAN;
    else if (!whole(p, p->record, KINEMATICS_HAS_DYNAMICS))
        KERNEL(torques)(AT(part(p, p->record)));
    return field(p, STATE_TAU);
}

int ftqp_status(const ftqp *p) {
    const int code = is_open(p);
    return code ? code : p->status;
}

int ftqp_brakes(const ftqp *p, int *asks) {
    const int code = is_open(p);
    if (code) return code;
    const int64_t kind = whole(p, p->record, FEEDBACK_BRAKES);
    const int blind = whole(p, p->record, FEEDBACK_KIND) == TORQUE_DRIVE; /* it cannot hold a joint that it does not see */
    int count = 0;
    for (int i = 0; i < p->joints; i++) {
        const uint64_t at = 8 * (uint64_t)i;
        const int one = whole(p, p->record, FEEDBACK_ASKS + at) || (blind && whole(p, p->record, FEEDBACK_LOST + at));
        if (asks != NULL) asks[i] = kind == EACH_BRAKES && one;
        count += one;
    }
    if (kind == EACH_BRAKES || !count) return count;
    if (asks != NULL)
        for (int i = 0; i < p->joints; i++) asks[i] = kind == ALL_BRAKES;
    return kind == ALL_BRAKES ? p->joints : 0;
}

int ftqp_stop_reason(const ftqp *p) {
    const int code = is_open(p);
    if (code) return code;
    return whole(p, p->record, WATCH_LATCHED) ? (int)whole(p, p->record, WATCH_REASON) : FTQP_STOP_NONE;
}

double ftqp_error(const ftqp *p) { return is_open(p) ? (double)NAN : *field(p, TASK_POSITION_ERROR); }

int ftqp_tip(const ftqp *p, double *pose) {
    const int code = is_open(p);
    if (code) return code;
    if (pose == NULL) return FTQP_NULL;
    if (p->status < 0) return FTQP_NOT_RESET;
    const double *R = field(p, KINEMATICS_R_TIP), *o = field(p, KINEMATICS_O_TIP);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) pose[4 * i + k] = R[3 * i + k];
        pose[4 * i + 3] = o[i];
        pose[12 + i] = 0.0;
    }
    pose[15] = 1.0;
    return 0;
}

int ftqp_joints(const ftqp *p) {
    const int code = is_open(p);
    return code ? code : p->joints;
}

int ftqp_drive(const ftqp *p) {
    const int code = is_open(p);
    return code ? code : (int)whole(p, p->record, FEEDBACK_KIND);
}

double ftqp_dt(const ftqp *p) { return is_open(p) ? (double)NAN : *field(p, STATE_DT); }

int ftqp_watch(ftqp *p, const double *tau) {
    const int code = is_open(p);
    if (code) return code;
    (void)tau;
    if (!whole(p, p->record, MONITOR_NAMES)) return FTQP_UNSUPPORTED;
    if (p->status < 0) return FTQP_NOT_RESET;
    const uint32_t before = p->noticed;
    p->noticed = findings(p);
    if (p->noticed != before) return 2;
    return *field(p, MONITOR_WORST) > SUSPECTS ? 1 : 0;
}

int ftqp_detect(ftqp *p, ftqp_finding *out, int most) {
    const int code = is_open(p);
    if (code) return code;
    if (!whole(p, p->record, MONITOR_NAMES)) return FTQP_UNSUPPORTED;
    if (out == NULL && most > 0) return FTQP_NULL;
    const double dt = *field(p, STATE_DT);
    int found = 0;
    for (int i = 0; i < p->joints && found < most; i++) {
        const uint64_t at = 8 * (uint64_t)i;
        const int64_t kinds = whole(p, p->record, MONITOR_FOUND + at);
        if (!kinds) continue;
        double count = 0.0;
        for (int64_t rest = kinds; rest; rest &= rest - 1) count += 1.0;
        out[found].joint = i;
        out[found].kinds = (int32_t)kinds;
        out[found].probability = 1.0 / count;
        out[found].onset = (double)whole(p, p->record, MONITOR_BEGAN + at) * dt;
        out[found].detected_at = (double)whole(p, p->record, MONITOR_FOUND_AT + at) * dt;
        out[found].share = (double)NAN;
        found++;
    }
    return found;
}

#define SENTENCE(code, text) case code: return text;

const char *ftqp_stop_reason_name(int reason) {
    switch (reason) {
        STOP_SENTENCES
        default: return reason < 0 ? ftqp_status_name(reason) : "no reason for a stop of ftqp";
    }
}

const char *ftqp_status_name(int status) {
    switch (status) {
        SENTENCES
        case FTQP_BEYOND_LIMITS:
            return "the start is beyond the range or the speed of a joint; expected rad, rad/s, m and m/s within arm.h";
        case FTQP_NO_ROTATION: return "the task has rotation rows but the target has a position only";
        case FTQP_NOT_RESET: return "the planner has no start; call ftqp_reset before the first step";
        case FTQP_TWIST_ALONE: return "the target has a twist alone and no place to be at";
        case FTQP_NULL: return "a pointer is NULL that must not be";
        case FTQP_MISALIGNED: return "the planner's memory is not aligned to FTQP_ALIGNMENT bytes";
        case FTQP_NOT_OPEN: return "this memory holds no planner; call ftqp_open first";
        case FTQP_NO_FILE: return "these bytes are no arm.ftqp; take the file that ftqp build has written";
        case FTQP_OTHER_FORMAT: return "the arm's file was written by another version of ftqp; build it anew";
        case FTQP_OTHER_KERNEL: return "the arm's file belongs to a library with other formulas; build both anew";
        case FTQP_CUT_SHORT: return "the arm's file has another length than it says; copy it anew";
        case FTQP_CHECKSUM: return "bytes of the arm's file were changed; copy it anew";
        case FTQP_DAMAGED: return "the arm's file makes no sense; build it anew";
        case FTQP_NO_JOINT: return "the arm has no such joint, or that joint has no motor; see arm.h";
        case FTQP_BAD_FAULT: return "a number of the fault is out of its range; see ftqp_fault in ftqp.h";
        case FTQP_BAD_LOAD: return "no rigid body has that mass and inertia, or no arm carries it";
        case FTQP_BAD_TICKS: return "ticks is below 1, expected how many periods the last step is ago; or looks is";
        case FTQP_NOT_FINITE: return "the start is not finite";
        case FTQP_BAD_SPEED: return "the speed is not in (0, 1], a share of the path's own";
        case FTQP_OTHER_ARM: return "the arm's file is of another arm than arm.h; take both from one build";
        case FTQP_BAD_LENGTH: return "an array has another length than the arm has joints";
        case FTQP_NO_TASK: return "the planner has no such further task; see arm.h";
        case FTQP_NO_THING: return "nothing of that number stood in the scene when it was built; see arm.h";
        case FTQP_NO_POSE: return "these numbers are no pose, or not finite; the last one stays";
        case FTQP_BAD_WEIGHT: return "the weight is below 0 or not finite, or, on level 0, neither 0 nor 1";
        case FTQP_NOT_FREE: return "that joint is not believed to swing freely; report it as locked if it stands";
        case FTQP_PROCESSOR: return "this processor lacks instructions that the library uses; build it for a lower class, --cpu";
        case FTQP_NO_POSTURE: return "a posture is not finite, or puts a joint outside its range in arm.h; or a pose has none";
        case FTQP_NO_GOAL: return "no goal was given; call ftqp_go_to before ftqp_go, and ftqp_seek before ftqp_find";
        case FTQP_NO_WAY: return "all ways out were tried, or this one was not found";
        case FTQP_UNSUPPORTED: return "this build, or this arm, does not have that; see bill.json";
        case FTQP_INTERNAL: return "compiled code has failed, which is a defect of ftqp; please report it";
        default: return "no status of ftqp";
    }
}
