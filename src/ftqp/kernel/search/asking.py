"""What is asked of a search, and its begin: rows and goal, a tube, a straight way of the tip, or places."""

from math import pi
from typing import Any

from ftqp.kernel.arm.pose_error import exponential, turn_between
from ftqp.kernel.commands.surroundings import NO_GOAL, NO_POSE, NO_REACH, is_pose
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.thresholds import (
    LEAST_ACCELERATION,
    LENGTH_FRACTION,
    REACHES,
    RISE_TIME,
    STRONG,
)
from ftqp.kernel.layout.ways_room import MOST, PLANNERS_ROWS, SHORTENING_LOOKS
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.search.known_arm import know_arm
from ftqp.kernel.search.looks import pose_arm
from ftqp.kernel.search.motion import begin_search

STARTS = 600
"""Newton starts for postures of a goal. 4,000 more brought no further clear posture in 1,373 cases."""
TURN = 2.0 * pi
"""Goal postures are looked for within a turn of each joint from where it is. A convention."""
PLACE, TURNED = 1e-3, 5e-3
"""How near a posture in C comes to its pose [m, rad]: the defaults of ``GoTo``."""
LINE, LEAP = 60, 0.3
"""The straight way of the tip is followed in so many places, and from one to the next joints go this far at
most [rad or m]. Guesses."""
TIP_SPEED, TIP_ACCELERATION = (0.5, 1.5), (2.0, 6.0)
"""Limits of the tip on a straight way in C, linear and angular: the defaults of ``ftqp.TipLimits``."""


@jit
def _draw_about(K: Any, q: Any, seed: int) -> None:
    """Draw starts within a turn from q: the same seed draws the same ones."""
    W = K.ways
    W.most_starts, W.first, W.second = STARTS, 1 + 7919 * seed, 1 + 104729 * seed
    for j in range(K.chain.n):
        W.low[j], W.high[j] = max(W.q_min[j], q[j] - TURN), min(W.q_max[j], q[j] + TURN)


@part_jit
def _choose_rows(K: Any, rows: int, has_axis: int) -> None:
    """Let these rows of poses count, of the tool's axis as the z axis of the frame that is looked at."""
    W, R = K.ways, K.chain.tip_rotation
    W.has_axis, W.rows, W.goal_rows = has_axis, rows, rows
    for i in range(3 if has_axis else 0):
        x, y, z = R[3 * i], R[3 * i + 1], R[3 * i + 2]
        for k in range(3):
            R[3 * i + k] = x * W.tool[k] + y * W.tool[3 + k] + z * W.tool[6 + k]


@jit
def _frame_at(W: Any, T: Any, out: Any) -> None:
    """The frame that is looked at where the tip is at a pose, by rows; ``out`` may be the pose."""
    for i in range(3):
        x, y, z = T[4 * i], T[4 * i + 1], T[4 * i + 2]
        out[4 * i], out[4 * i + 1], out[4 * i + 2], out[4 * i + 3] = x, y, z, T[4 * i + 3]
        for k in range(3 if W.has_axis else 0):
            out[4 * i + k] = x * W.tool[k] + y * W.tool[3 + k] + z * W.tool[6 + k]


@part_jit
def aim_at(K: Any, T: Any) -> None:
    """Let the goal be a pose of the tip, (16,), and starts for its postures begin anew."""
    K.ways.has_goal, K.ways.starts = 1, 0
    _frame_at(K.ways, T, K.ways.goal)


@part_jit
def _draw_line(K: Any, q: Any) -> None:
    """Let the path be the straight way of the tip from a posture to the goal."""
    W, o, R, turned = K.ways, K.ahead.o_tip, K.ahead.R_tip, K.ways.turned
    pose_arm(K, q)
    x, y, z = turn_between(W.goal, 4, R, 3)
    W.path = LINE + 1
    for k in range(LINE + 1):
        share, T = k / LINE, W.path_pose[k]
        exponential(share * x, share * y, share * z, turned)
        for i in range(3):
            T[4 * i + 3] = o[i] + share * (W.goal[4 * i + 3] - o[i])
            for c in range(3):
                T[4 * i + c] = (
                    turned[3 * i] * R[c] + turned[3 * i + 1] * R[3 + c] + turned[3 * i + 2] * R[6 + c]
                )
    for j in range(K.chain.n):
        W.leap[j] = LEAP


@part_jit
def know_asked(K: Any, P: Any) -> None:
    """Take over an arm as a planner believes it, and the rows that count, of the tip's frame, too."""
    W, task, rows, has_axis = K.ways, P.task, K.ways.asks_rows, K.ways.asks_axis
    know_arm(K, P)
    W.effort, W.dt, W.speed, W.rise = STRONG, P.state.dt, P.feedback.speed, W.asks_rise
    for j in range(K.chain.n):
        W.a_max[j] = max(W.a_max[j], W.a_least[j])
        W.rise = max(W.rise, W.a_max[j] / W.jerk[j]) if W.free[j] else W.rise
    if rows == PLANNERS_ROWS:
        rows, has_axis = 0, task.tool_rows
        for k in range(task.m):
            rows |= 1 << task.rows[k]
    _choose_rows(K, rows, has_axis)


@part_jit
def begin_asked(K: Any, P: Any, q: Any, seed: int) -> int:
    """Begin to search at q for what is asked, with an arm as a planner believes it: what stands there."""
    W = K.ways
    know_asked(K, P)
    W.most, W.nears, W.straight, W.has_goal = W.asks_most, W.asks_nears, W.asks_straight, 0
    _draw_about(K, q, seed)
    if W.asks_pose:
        aim_at(K, W.given_goal)
    for k in range(W.tube):
        _frame_at(W, W.given_tube[k], W.tube_pose[k])
    if W.straight:
        _draw_line(K, q)
    else:
        for k in range(W.path):
            _frame_at(W, W.path_pose[k], W.path_pose[k])
    W.start_met = W.goal_met = begin_search(K, q)
    return int(W.start_met)


@jit
def ask_as_given(K: Any, P: Any, given: Any, T: Any) -> None:
    """Ask as ``GoTo`` does for a pose, (16,), of an arm in C; a posture is added as a goal."""
    W = K.ways
    W.asks_rows, W.asks_axis, W.asks_places, W.tube, W.path = PLANNERS_ROWS, 0, 0, 0, 0
    W.asks_pose, W.asks_nears, W.asks_straight, W.asks_most = 1, 1, 1, MOST
    W.asks_rise, W.shortening, W.length = RISE_TIME, SHORTENING_LOOKS, given.length
    W.tolerance[0], W.tolerance[1] = PLACE, TURNED * given.length
    for k in range(2):
        W.tip_speed[k], W.tip_acceleration[k] = TIP_SPEED[k], TIP_ACCELERATION[k]
    for j in range(P.chain.n):
        W.a_least[j], W.jerk[j] = LEAST_ACCELERATION * given.a_max[j], given.jerk[j]
    assign(W.given_goal, T, 16)


@jit
def cannot_seek(P: Any, given: Any, T: Any) -> int:
    """Why postures of a pose, (16,), cannot be looked for; 0 where they can.

    NO_POSE; NO_GOAL of an arm that is not one chain, or of which no joint works or one swings freely; or
    NO_REACH of a pose as far away as one in millimetres.
    """
    if not is_pose(T):
        return NO_POSE
    chain, works, endless = P.chain, False, False
    for j in range(chain.n):
        works = works or P.faults.code[j] == HEALTHY
        endless = endless or (chain.prismatic[j] and not is_finite(given.q_max[j] - given.q_min[j]))
    if not works or chain.is_tree or chain.mimics or chain.floating or given.swings:
        return NO_GOAL
    far = REACHES * given.length / LENGTH_FRACTION
    is_far = T[3] * T[3] + T[7] * T[7] + T[11] * T[11] > far * far
    return NO_REACH if is_far and not endless else 0


@part_jit
def seek(K: Any, P: Any, given: Any, T: Any) -> int:
    """Begin to look for postures of a pose, (16,), from the last command: 0, or see ``cannot_seek``."""
    why = cannot_seek(P, given, T)
    if why:
        return why
    ask_as_given(K, P, given, T)
    K.ways.asks_straight = K.ways.asks_nears = 0
    begin_asked(K, P, P.state.q_command, 0)
    return 0
