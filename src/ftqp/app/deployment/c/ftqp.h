/* ftqp.h - the planner of ftqp for programs in C and C++. The same text for every arm.

   A loop, once a period (see example/main.c):

       ftqp_step(p, q, v, &target, 1);      q, v: what the encoders say now
       send(ftqp_q(p));                     or ftqp_v, ftqp_tau: what your drive takes

   No call but ftqp_size, ftqp_open, ftqp_ways_out and ftqp_try, and an ftqp_go that looks for a way, takes longer than some
   steps; none allocates, locks, calls the system, keeps a pointer of yours but that of a search or of ways out, or has a
   loop without a bound.
   One planner belongs to one thread at a time; as many planners as you like may run side by side. A planner is plain
   memory: memcpy makes a copy that goes on from the same state, without a search.

   Units are SI: m, rad, s, N, N m, kg. Joints are counted from 0, in the order of arm.h. */
#ifndef FTQP_H
#define FTQP_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define FTQP_ALIGNMENT 64 /* of the memory that a planner lies in [bytes] */
#define FTQP_MOST_TICKS 5 /* a gap of more periods counts as one of so many */

/* What a step says, from 0 on; ftqp_status_name gives each a sentence. */
enum {
    FTQP_OK = 0,        /* the task is followed and every limit is kept */
    FTQP_RELAXED = 1,   /* the task cannot be followed exactly; the nearest feasible motion is done */
    FTQP_SCALED = 2,    /* the task is followed more slowly */
    FTQP_LAGGING = 3,   /* the command follows the task, the arm does not follow the command */
    FTQP_FALLBACK = 4,  /* no usable answer was found; the last command is braked */
    FTQP_STOPPING = 5,  /* a stop is latched and the arm brakes */
    FTQP_STOPPED = 6,   /* a stop is latched and the arm rests */
    FTQP_INVALID_INPUT = 7, /* what was measured or asked cannot be used; the command is safe */
    FTQP_HELD = 8       /* the whole arm is held; the planner waits, and goes on when it is released */
};

/* What ftqp_reset warns of. */
enum { FTQP_BEYOND_LIMITS = 100 };

/* Mistakes of the program, below 0: nothing was done. */
enum {
    FTQP_NO_ROTATION = -2, /* the task has rotation rows, the target a position only */
    FTQP_NOT_RESET = -3,   /* no start is known: call ftqp_reset first */
    FTQP_TWIST_ALONE = -5, /* the target's has_rotation is negative */
    FTQP_NULL = -20,       /* a pointer that must not be NULL is */
    FTQP_MISALIGNED = -21, /* the planner's memory does not begin at a multiple of FTQP_ALIGNMENT */
    FTQP_NOT_OPEN = -22,   /* this memory holds no planner: call ftqp_open first */
    FTQP_NO_FILE = -23,    /* these bytes are no arm.ftqp */
    FTQP_OTHER_FORMAT = -24, /* written by another version of ftqp build */
    FTQP_OTHER_KERNEL = -25, /* made for a library with other formulas: build both anew */
    FTQP_CUT_SHORT = -26,  /* bytes are missing, or too many */
    FTQP_CHECKSUM = -27,   /* bytes were changed */
    FTQP_DAMAGED = -28,    /* the contents make no sense */
    FTQP_NO_JOINT = -29,   /* the arm has no such joint, or it has no motor */
    FTQP_BAD_FAULT = -30,  /* a number of the fault is out of its range */
    FTQP_BAD_LOAD = -31,   /* no rigid body has that mass and inertia */
    FTQP_BAD_TICKS = -32,  /* ticks, or looks, is below 1 */
    FTQP_NOT_FINITE = -33, /* a start that is not finite */
    FTQP_UNSUPPORTED = -34, /* this build or this arm does not have it */
    FTQP_BAD_SPEED = -35,  /* a speed is not in (0, 1] */
    FTQP_OTHER_ARM = -36,  /* the file is of another arm than the arm.h of the program */
    FTQP_BAD_LENGTH = -37, /* an array in C++ has another length than the arm has joints */
    FTQP_NO_TASK = -38,    /* the planner has no such further task */
    FTQP_NO_THING = -39,   /* nothing of that number stood in the scene when it was built */
    FTQP_NO_POSE = -40,    /* numbers are no pose, or not finite */
    FTQP_BAD_WEIGHT = -41, /* a weight is below 0, or of a task on level 0 neither 0 nor 1 */
    FTQP_NOT_FREE = -42,   /* a joint whose brake shall close is not believed to swing freely */
    FTQP_PROCESSOR = -43,  /* the library was built for a processor with more instructions */
    FTQP_NO_POSTURE = -44, /* a posture is not finite, or puts a joint outside its range; or a pose has none */
    FTQP_NO_GOAL = -45,    /* ftqp_go was called without a goal or its search, or ftqp_find before ftqp_seek */
    FTQP_NO_WAY = -46,     /* all ways out were tried, or this one was not found */
    FTQP_INTERNAL = -999   /* a defect of ftqp */
};

/* Why a stop is latched. */
enum {
    FTQP_STOP_NONE = 0,
    FTQP_STOP_ASKED = 1,       /* by ftqp_stop */
    FTQP_STOP_ERROR = 2,       /* the task error was too large and rose */
    FTQP_STOP_FALLBACKS = 3,   /* no usable command was found for too long */
    FTQP_STOP_SENSOR = 4,      /* a sensor has said impossible things for too long */
    FTQP_STOP_DEVIATION = 5,   /* the end effector is too far from where it was sent */
    FTQP_STOP_LAG = 6,         /* the arm does not follow */
    FTQP_STOP_FREE_JOINT = 7,  /* a joint swings freely and nothing of the task can be kept */
    FTQP_STOP_OVERLOAD = 8,    /* a weak joint cannot hold the arm */
    FTQP_STOP_SECOND_FREE = 9, /* a second joint seems to swing freely */
    FTQP_STOP_CLEARANCE = 10,  /* two bodies came too near */
    FTQP_STOP_SCENE = 11       /* something stands in the scene that nothing is watched against */
};

/* A planner: memory of ftqp_size bytes that you own, aligned to FTQP_ALIGNMENT. */
typedef struct ftqp ftqp;

/* A search for ways and postures: memory of ftqp_search_size bytes that you own, aligned to FTQP_ALIGNMENT. */
typedef struct ftqp_search ftqp_search;

/* Ways out of where an arm is stuck: memory of ftqp_ways_size bytes that you own, aligned to FTQP_ALIGNMENT. */
typedef struct ftqp_ways ftqp_ways;

/* Where the end effector should be now. */
typedef struct ftqp_target {
    double pose[16];        /* homogeneous transform by rows, tip in the base frame W */
    double twist[6];        /* linear, then angular, along W */
    double acceleration[6]; /* the same */
    double has_rotation;    /* 1: the rotation of pose counts; 0: its position alone, for position tasks */
} ftqp_target;

enum { FTQP_SENDS_POSITIONS = 0, FTQP_SENDS_VELOCITIES = 1, FTQP_SENDS_TORQUES = 2 };
enum { FTQP_LOCKED = 1, FTQP_FREE_SWINGING = 2, FTQP_DEGRADED = 3 };
enum { FTQP_RAMP = 0, FTQP_INSTANT = 1 };
enum { FTQP_KINEMATIC = 0, FTQP_MOMENTUM = 1, FTQP_TASK = 2 };

/* A fault of a joint: begin with ftqp_locked(i), ftqp_free_swinging(i) or ftqp_degraded(i), then change. */
typedef struct ftqp_fault {
    int32_t joint;
    int32_t kind;        /* FTQP_LOCKED, FTQP_FREE_SWINGING or FTQP_DEGRADED */
    int32_t mode;        /* locked: FTQP_RAMP brakes first, FTQP_INSTANT is at rest at once */
    int32_t reset;       /* instant: what the velocities of the other joints do */
    double deceleration; /* ramp: > 0; NaN is a quarter of the joint's acceleration limit */
    double damping;      /* free-swinging: viscous friction on top of the arm's own, >= 0 */
    double friction;     /* free-swinging: Coulomb friction on top of the arm's own, >= 0 */
    double velocity;     /* degraded: share of the speed limit that is left, in (0, 1] */
    double acceleration; /* degraded: share of the acceleration limit */
    double torque;       /* degraded: share of the torque limit */
    double q_min, q_max; /* degraded: the range that is left; NaN leaves an end as it is */
} ftqp_fault;

/* A load in the frame of the arm's own tip. */
typedef struct ftqp_load {
    double mass;       /* > 0 */
    double com[3];     /* its centre of mass */
    double inertia[9]; /* about that, along the axes of the tip's frame, by rows; zeros are a point mass */
} ftqp_load;

/* What may have happened to a joint, bit by bit: more than one where they cannot be distinguished. */
enum {
    FTQP_FOUND_LOCKED = 1, FTQP_FOUND_FREE_SWINGING = 2, FTQP_FOUND_DEGRADED = 4, FTQP_FOUND_RUNAWAY = 8,
    FTQP_FOUND_SENSOR_FROZEN = 16, FTQP_FOUND_SENSOR_BIASED = 32, FTQP_FOUND_SENSOR_DROPPED = 64
};

/* What was found of a joint. */
typedef struct ftqp_finding {
    int32_t joint;
    int32_t kinds;      /* a sum of FTQP_FOUND_... */
    double probability; /* of each of them, as none speaks for one more than for another */
    double onset;       /* when it began, by estimate, since the reset [s] */
    double detected_at; /* when that was certain, since the reset [s] */
    double share;       /* NaN; a place that is kept */
} ftqp_finding;

/* What a planner may have: what it has not answers FTQP_UNSUPPORTED where it is asked for. */
enum {
    FTQP_HAS_DETECTOR = 1,    /* ftqp_watch, ftqp_detect */
    FTQP_HAS_PATH = 2,        /* ftqp_follow, ftqp_begin, ftqp_speed */
    FTQP_HAS_TASKS = 3,       /* tasks besides that of the end effector */
    FTQP_HAS_THINGS = 4,      /* things in its scene that can be moved */
    FTQP_HAS_MASSES = 5,      /* ftqp_tau, ftqp_carry */
    FTQP_HAS_FREE_JOINTS = 6, /* faults of kind FTQP_FREE_SWINGING */
    FTQP_HAS_GOALS = 7,       /* ftqp_go_to, straight; ftqp_go_round and ftqp_go_to_pose go anywhere */
    FTQP_HAS_WAYS_OUT = 8,    /* ftqp_ways_out, ftqp_try, ftqp_go_out */
    FTQP_HAS_WAY_BACK = 9     /* of these, the way that the arm has come: built with remember, see ftqp_ways_out */
};

/* Where an arm stands on its way to a posture. */
enum {
    FTQP_MOVING = 0,      /* the arm is on its way */
    FTQP_REACHED = 1,     /* it rests at its goal */
    FTQP_UNREACHABLE = 2, /* it rests as near as it gets: a joint that has failed or is too weak is elsewhere */
    FTQP_HALTED = 3       /* a stop is latched; it goes on after ftqp_resume */
};

/* Ways out of where an arm is stuck, in the order in which they are tried. */
enum {
    FTQP_WAY_BACK = 0,        /* back along the way that the joints have come */
    FTQP_WAY_BACK_BY_TIP = 1, /* after a failure: back along the way of the end effector */
    FTQP_WAY_HOME = 2,
    FTQP_WAY_HALT = 3,        /* to a posture near by in which the arm can stand for long */
    FTQP_WAY_STOP = 4         /* where braking ends */
};

/* A way out, as it was tried. */
typedef struct ftqp_way {
    int64_t kind;     /* FTQP_WAY_BACK and others */
    int64_t clear;    /* 1: it arrives, motors can hold the arm everywhere on it, and it meets nothing */
    int64_t arrives;  /* 1: the arm comes to rest at its end, without a stop */
    int64_t near;     /* 1: it comes too near to something */
    int64_t still;    /* rows in which the end effector can still move at its end: 6 all, 5 all but a turn about the
                         tool's axis, 3 its place, 0 */
    int64_t rows;     /* back by the tip: which of x, y, z, rx, ry, rz are kept on the way, a bit each, x is 1 */
    double time;      /* how long it takes [s]: to the tick, where the arm follows its commands */
    double clearance; /* the least distance on the way from what it must not meet [m]; HUGE_VAL: nothing is known */
    double effort;    /* the largest share of a torque limit that holds the arm at its end */
    double limit;     /* from the joint that is nearest to an end of its range, at its end [rad or m] */
    double force;     /* the largest force that the base bears on the way [N]; 0 without masses */
    double moment;    /* the largest torque, about its origin [N m] */
} ftqp_way;

/* How many bytes a planner from this file needs, into *need: 0, or a mistake. */
int ftqp_size(const void *file, size_t bytes, size_t *need);

/* Make a planner from the bytes of arm.ftqp: 0, or a mistake. It needs ftqp_reset before its first step. Whatever
   arm the file is of is taken: a program that includes arm.h calls ftqp_open_for. */
int ftqp_open(ftqp *p, const void *file, size_t bytes);

/* The same for the arm of arm.h, FTQP_ARM_JOINTS and FTQP_ARM_FINGERPRINT: the file of another one is FTQP_OTHER_ARM,
   and nothing is done. */
int ftqp_open_for(ftqp *p, const void *file, size_t bytes, int joints, uint64_t fingerprint);

/* Begin at joint positions and velocities; v may be NULL: at rest. Stops are released, faults stay. 0; or a warning,
   FTQP_BEYOND_LIMITS, where a joint is beyond its range or faster than its limit, as with degrees in place of radians:
   the planner has begun there, too, and leads such joints back; or a mistake. */
int ftqp_reset(ftqp *p, const double *q, const double *v);

/* The command for the next period: a status, or a mistake. q: measured positions; v: measured velocities, only
   looked at to see whether they are finite, or NULL. ticks: periods since the last step, 1 in a loop that is
   on time; ticks that were missed are made up for, so that the command keeps every limit over the gap. */
int ftqp_step(ftqp *p, const double *q, const double *v, const ftqp_target *target, int ticks);

/* The same along the path of the file, in builds with one: it is gone only as fast as the arm can follow. */
int ftqp_follow(ftqp *p, const double *q, const double *v, int ticks);

/* How far along its path the arm is, in the path's own time [s]; its end, where it stays, is FTQP_ARM_PATH_DURATION of
   arm.h. NaN in builds without a path. */
double ftqp_progress(const ftqp *p);

/* Begin the path anew, where the arm stands at its begin; ftqp_reset does it, too. */
int ftqp_begin(ftqp *p);

/* Count on a fault from the next step on; it takes the place of another one of the same joint. */
int ftqp_report(ftqp *p, const ftqp_fault *fault);

/* Count on the joint to be healthy again. */
int ftqp_withdraw(ftqp *p, int joint);

/* The fault of a joint that counts, by report or by finding: 0 it works, FTQP_LOCKED and others; or a mistake. */
int ftqp_believed(const ftqp *p, int joint);

/* Brake every healthy joint from the next step on and hold it, until ftqp_resume or ftqp_reset. */
int ftqp_stop(ftqp *p);

/* Go on from where the arm is: 1, or 0 while a lost sensor or the arm's brake forbids it, which needs ftqp_reset. */
int ftqp_resume(ftqp *p);

/* Go to a posture from the next ftqp_go on, n numbers within the joints' ranges, with limited jerk and as fast as the
   limits allow that are believed. Other joints go on when one fails, to arrive and rest there.
   FTQP_UNSUPPORTED where distances, points or axes are kept: the straight way need not be free. */
int ftqp_go_to(ftqp *p, const double *q);

/* The same round what is kept: the arm comes to rest, each ftqp_go looks at some postures more (50 at 1 kHz), and goes
   the way that was found, once its motion is proven free. It looks again when a joint fails or a thing is moved. The search
   is the planner's, not a copy's, until another goal is given. Where no way is found the joints go as near as they get. */
int ftqp_go_round(ftqp *p, ftqp_search *s, const double *q);

/* The same to a pose of the end effector, 16 numbers by rows: on its straight way where the joints can follow that, else
   to any posture of the pose, or to the nearest one that is found. FTQP_UNSUPPORTED where a joint swings freely, or the
   arm is not one chain; FTQP_NO_POSTURE of a pose 20 times as far away as the arm reaches, as in millimetres. */
int ftqp_go_to_pose(ftqp *p, ftqp_search *s, const double *pose);

/* The command for the next period on the way to the posture: a status, or a mistake; q and v as of ftqp_step. A period
   that is missed makes the motion later, and never jumps. An arm that does not come to rest is stopped. */
int ftqp_go(ftqp *p, const double *q, const double *v);

/* Where the arm stands on its way, as it was measured for the last ftqp_go: FTQP_MOVING and others, or a mistake.
   Joints that are within 1 mrad or 1 mm of their goal have reached it. */
int ftqp_arrived(const ftqp *p);

/* How many bytes ways out take; 0 of memory that holds no planner. */
size_t ftqp_ways_size(const ftqp *p);

/* Begin to look for ways out of where the arm is commanded to be, at rest or moving, also where it is stopped: with the
   joints that work, as the planner believes them now. home: where the arm belongs, n numbers, ftqp_arm_neutral of arm.h;
   NULL leaves that way out. There is a way back where the arm was built with remember, the seconds of motion that are kept
   (remember = 20.0 under [planner] of a scenario; a robot without one has 20 s). While a joint swings freely there is the
   stop only; where it hangs at rest beside a brake of its own, each way begins with that brake. The planner is copied,
   ftqp_size bytes, and is left as it is; ask anew when a joint fails or a thing is moved. FTQP_UNSUPPORTED of an arm whose
   base floats. */
int ftqp_ways_out(const ftqp *p, ftqp_ways *w, const double *home);

/* Think on for about so many looks at postures or steps of the arm, 1 and more: 1, and one way more was tried, out; 0: not
   yet, call it again, in the next period if you like; FTQP_NO_WAY: all were. Looks of any number find the same, as
   planner.ways_out() does in Python. A look takes as long as a step, but for
   calls that copy the planner, where a way begins, or find the pace of its motion: those take some hundred steps. */
int ftqp_try(ftqp_ways *w, int looks, ftqp_way *out);

/* Go a way out that was tried, from the next ftqp_go on; of a kind that was tried with several sets of rows the last one.
   A planner that is stopped goes on after ftqp_resume. The memory is the planner's until another goal is given. */
int ftqp_go_out(ftqp *p, ftqp_ways *w, int kind);

/* How many bytes a search takes. Most are not touched by ftqp_find, and mostly no memory of the system then. */
size_t ftqp_search_size(void);

/* Begin to look for postures for a pose of the end effector, 16 numbers by rows, with the rows that the task has now: of
   the joints that work, from the planner's own positions, within what is believed of ranges, motors and the scene. 0, or
   a mistake: FTQP_UNSUPPORTED where a joint swings freely, or the arm is not one chain. Begin anew when a joint
   fails: what was found before does not know of that. */
int ftqp_seek(const ftqp *p, ftqp_search *s, const double *pose);

/* Look on for about so many looks at postures, 1 and more: 1, and a posture in q, n numbers for ftqp_go_to, looked for
   from the arm on and then farther away; 0: not yet, call it again, in the next period if you like; FTQP_NO_POSTURE: no more were found. Looks of
   any number find the same. Postures come within 1 mm and 5 mrad of the pose, mostly nearer by far. */
int ftqp_find(ftqp_search *s, int looks, double *q);

/* How fast the path is led, in (0, 1] of its own speed; FTQP_UNSUPPORTED in builds without one. */
int ftqp_speed(ftqp *p, double share);

/* Count on a load at the end effector from the next step on; NULL is none. It takes a millisecond: call it at rest. */
int ftqp_carry(ftqp *p, const ftqp_load *load);

/* Control another point from the next step on: T, 16 numbers by rows, in the frame of the arm's own tip; NULL is that
   tip. Targets are then of that point. Masses stay: a tool that weighs something is a load, too. */
int ftqp_tool(ftqp *p, const double *T);

/* Let the brake of a joint that swings freely be closed, and count on it to stand: ftqp_brakes names it. */
int ftqp_brake(ftqp *p, int joint);

/* Whether the planner has something, FTQP_HAS_...: 1 or 0. */
int ftqp_has(const ftqp *p, int what);

/* How many tasks there are besides that of the end effector; they are counted from 0, in the order of arm.h. A goal that
   nobody has given is where the arm is at ftqp_reset. */
int ftqp_tasks(const ftqp *p);

/* Where the frame, the point or the centre of mass of a task should be from the next step on, its rotation included where
   it has rows of that; of an axis the place in pose, 3, 7 and 11, is what it points along, or at. FTQP_NO_POSE where that
   cannot be used: the last one stays. */
int ftqp_aim(ftqp *p, int task, const ftqp_target *target);

/* Where the joints of a task of joints should be, n numbers. */
int ftqp_aim_joints(ftqp *p, int task, const double *q);

/* How much a task counts, >= 0: 0 leaves it out; on level 0, where it is an equation, 0 or 1. */
int ftqp_weight(ftqp *p, int task, double weight);

/* How far a task was from its goal before the last step, 6 numbers [m, rad] along W; FTQP_UNSUPPORTED of joints. */
int ftqp_task_error(const ftqp *p, int task, double *error);

/* How many things stand in the scene; they are counted from 0, in the order of arm.h. */
int ftqp_things(const ftqp *p);

/* Say where one of them is now, 16 numbers by rows in the base frame W, and with which twist along W it goes on until it
   is moved again, NULL: it stands. What is not there is moved far away. */
int ftqp_move(ftqp *p, int thing, const double *pose, const double *twist);

/* How far the two nearest bodies will be from each other after the last step [m]; NaN where none are kept apart. */
double ftqp_clearance(const ftqp *p);

/* The command of the last step, n numbers each, valid until the next one; NULL of memory that holds no planner.
   They may be handed back to ftqp_step: what a call is given is copied.
   q: positions to send; v: velocities to send; a: accelerations; tau: torques to send, NaN without masses. */
const double *ftqp_q(const ftqp *p);
const double *ftqp_v(const ftqp *p);
const double *ftqp_a(const ftqp *p);
const double *ftqp_tau(const ftqp *p);

/* The status of the last step, FTQP_NOT_RESET before the first. */
int ftqp_status(const ftqp *p);

/* Which joints ask for their brakes since the last step, 1 each into asks, n numbers, which may be NULL: how many, or
   a mistake. Close those brakes: a joint that asks is out of hand. Where the arm has one brake for all, all ask. */
int ftqp_brakes(const ftqp *p, int *asks);

/* Why a stop is latched: FTQP_STOP_NONE while none is, another FTQP_STOP_..., or a mistake. */
int ftqp_stop_reason(const ftqp *p);

/* A sentence for what ftqp_stop_reason says; never NULL. */
const char *ftqp_stop_reason_name(int reason);

/* How far the measured tip was from its target before the last step [m]. */
double ftqp_error(const ftqp *p);

/* The end effector of the planner's own positions at the last step, into pose, 16 numbers by rows: 0, or a mistake. */
int ftqp_tip(const ftqp *p, double *pose);

/* How many joints the arm has: or a mistake. */
int ftqp_joints(const ftqp *p);

/* What is to be sent to the arm, as the planner was made: FTQP_SENDS_POSITIONS and others, or a mistake. */
int ftqp_drive(const ftqp *p);

/* The period [s]; NaN of memory that holds no planner. */
double ftqp_dt(const ftqp *p);

/* A sentence for a status or a mistake; never NULL. */
const char *ftqp_status_name(int status);

/* What the planner has noticed by itself since it was asked last: 0 nothing, 1 a suspicion, 2 a joint was found to
   have failed, or to work after all; FTQP_UNSUPPORTED of planners made with detector=False. tau is not looked at and
   may be NULL. The planner counts on what it finds; ftqp_withdraw takes it back. */
int ftqp_watch(ftqp *p, const double *tau);

/* What it has found, at most so many: how many. */
int ftqp_detect(ftqp *p, ftqp_finding *out, int most);

static inline ftqp_fault ftqp_fault_of(int joint, int kind) {
    ftqp_fault fault = {0, 0, 0, 0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0};
    fault.joint = joint;
    fault.kind = kind;
    fault.deceleration = fault.q_min = fault.q_max = (double)NAN;
    return fault;
}

/* The joint holds still: its brake has closed. */
static inline ftqp_fault ftqp_locked(int joint) { return ftqp_fault_of(joint, FTQP_LOCKED); }

/* The joint has lost its motor and its brake. */
static inline ftqp_fault ftqp_free_swinging(int joint) { return ftqp_fault_of(joint, FTQP_FREE_SWINGING); }

/* The joint works, with less speed, acceleration, torque or range: write what is left. */
static inline ftqp_fault ftqp_degraded(int joint) { return ftqp_fault_of(joint, FTQP_DEGRADED); }

#ifdef __cplusplus
}
#endif
#endif
