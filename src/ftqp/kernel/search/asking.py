"""What is asked of a search: where starts are drawn, which rows of a pose count, and which pose it is."""

from math import pi
from typing import Any

from ftqp.kernel.commands.surroundings import NO_GOAL, NO_POSE, is_pose
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.thresholds import STRONG
from ftqp.kernel.search.known_arm import know_arm
from ftqp.kernel.search.motion import begin_search

STARTS = 600
"""Newton starts for postures of a goal. 4,000 more brought no further clear posture in 1,373 cases."""
TURN = 2.0 * pi
"""Goal postures are looked for within a turn of each joint from where it is. A convention."""
PLACE, TURNED = 1e-3, 5e-3
"""How near a posture in C comes to its pose [m, rad]: the defaults of ``GoTo``."""


@jit
def draw_about(K: Any, q: Any, seed: int) -> None:
    """Draw starts within a turn from q: the same seed draws the same ones."""
    W = K.ways
    W.most_starts, W.first, W.second = STARTS, 1 + 7919 * seed, 1 + 104729 * seed
    for j in range(K.chain.n):
        W.low[j], W.high[j] = max(W.q_min[j], q[j] - TURN), min(W.q_max[j], q[j] + TURN)


@part_jit
def choose_rows(K: Any, rows: int, has_axis: int) -> None:
    """Let these rows of poses count, of the tool's axis as the z axis of the frame that is looked at."""
    W, R = K.ways, K.chain.tip_rotation
    W.has_axis, W.rows, W.goal_rows = has_axis, rows, rows
    for i in range(3 if has_axis else 0):
        x, y, z = R[3 * i], R[3 * i + 1], R[3 * i + 2]
        for k in range(3):
            R[3 * i + k] = x * W.tool[k] + y * W.tool[3 + k] + z * W.tool[6 + k]


@part_jit
def aim_at(K: Any, T: Any) -> None:
    """Let the goal be a pose of the tip, (16,), and starts for its postures begin anew."""
    W = K.ways
    W.has_goal, W.starts = 1, 0
    for i in range(3):
        for k in range(4):
            W.goal[4 * i + k] = T[4 * i + k]
        for k in range(3 if W.has_axis else 0):
            W.goal[4 * i + k] = (
                T[4 * i] * W.tool[k] + T[4 * i + 1] * W.tool[3 + k] + T[4 * i + 2] * W.tool[6 + k]
            )


@part_jit
def seek(K: Any, P: Any, given: Any, T: Any) -> int:
    """Begin to look for postures of a pose, (16,), with the joints that work, from the last command.

    0; NO_POSE, or NO_GOAL of an arm that is not one chain, or of which no joint works or one swings freely.
    """
    W, chain, task, rows, works = K.ways, P.chain, P.task, 0, False
    if not is_pose(T):
        return NO_POSE
    for j in range(chain.n):
        works = works or P.faults.code[j] == HEALTHY
    if chain.is_tree or chain.mimics or chain.floating or given.swings or not works:
        return NO_GOAL
    know_arm(K, P, 0)
    W.effort, W.length = STRONG, given.length
    W.tolerance[0], W.tolerance[1] = PLACE, TURNED * given.length
    draw_about(K, P.state.q_command, 0)
    for k in range(task.m):
        rows |= 1 << task.rows[k]
    choose_rows(K, rows, task.tool_rows)
    aim_at(K, T)
    begin_search(K, P.state.q_command)
    return 0
