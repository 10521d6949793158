"""What a planner is given of its tool, of its further tasks and of what stands around it."""

from math import inf
from typing import Any

from ftqp.kernel.arm.kinematics import forward_kinematics, point_of
from ftqp.kernel.commands.believed import look_again
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import TARGET_ACCELERATION, TARGET_SIZE, TARGET_TWIST
from ftqp.kernel.layout.scene_room import AXIS, FRAME, JOINT_PLACES, MASS
from ftqp.kernel.maths.elementary import has_last_row, is_finite, is_rotation
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.vectors import Vector, length, minus, plus, rotated_back, three, times, write
from ftqp.kernel.rows.further_tasks import TURNS

NO_POSE = 1
"""What was given is no pose, or not finite, and nothing is changed; ..."""
NO_GOAL = 2
"""... what has no goal of that kind; ..."""
NO_REACH = 3
"""... and what is so far away that it is no place of the arm's."""


@jit
def is_pose(T: Any) -> bool:
    """Whether 16 numbers by rows are a pose."""
    for k in range(16):
        if not is_finite(T[k]):
            return False
    return has_last_row(T[12], T[13], T[14], T[15]) and is_rotation(T)


@jit
def hold(chain: Any, given: Any, T: Any) -> int:
    """The controlled point is at T, (16,), in the frame of the robot's own tip: 0, or NO_POSE."""
    if not is_pose(T):
        return NO_POSE
    R, t = given.tip_rotation, given.tip_translation
    for r in range(3):
        place = t[r]
        for k in range(3):
            place += R[3 * r + k] * T[4 * k + 3]
        chain.tip_translation[r] = place
        for c in range(3):
            chain.tip_rotation[3 * r + c] = (
                R[3 * r] * T[c] + R[3 * r + 1] * T[4 + c] + R[3 * r + 2] * T[8 + c]
            )
    return 0


@jit
def _axis_of(kinematics: Any, body: int, c: int) -> Vector:
    """Axis c of a joint's frame along W, or of the base."""
    if body < 0:
        return 1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0
    R = kinematics.R[body]
    return R[c], R[3 + c], R[6 + c]


@jit
def _begin(K: Any, t: int) -> None:
    """The goal of task t is where the arm is."""
    terms, kinematics, chain = K.terms, K.kinematics, K.chain
    if terms.kind[t] == JOINT_PLACES:
        assign(terms.q_goal[t], K.state.q, chain.n)
        return
    for k in range(6):
        terms.rate[t, k] = terms.rate_change[t, k] = 0.0
    if terms.kind[t] == MASS:
        total, centre = 0.0, (0.0, 0.0, 0.0)
        for i in range(chain.n):
            total += chain.mass[i]
        for i in range(chain.n):
            centre = plus(centre, times(chain.mass[i] / total, point_of(kinematics, i, chain.com[i])))
        write(terms.goal[t], 0, centre)
        return
    body, other = terms.body[t], terms.other[t]
    p = point_of(kinematics, body, terms.place[t])
    if other >= 0:
        p = rotated_back(kinematics.R[other], minus(p, three(kinematics.o[other])))
    write(terms.goal[t], 0, p)
    for c in range(3):
        x = _axis_of(kinematics, body, c)
        if other >= 0:
            x = rotated_back(kinematics.R[other], x)
        terms.turn[t, c], terms.turn[t, 3 + c], terms.turn[t, 6 + c] = x


@jit
def begin_terms(K: Any, given: Any) -> None:
    """Goals that nobody has given are where the arm begins, at ``state.q``."""
    known = False
    for t in range(K.terms.own):
        if given.begins[t] > 0:
            if not known:
                forward_kinematics(K, K.state)
            known = True
            _begin(K, t)


@jit
def _aim_point(terms: Any, t: int, target: Any) -> int:
    """The same of a place, of a direction, and of what has no rotation."""
    goal, x = terms.goal[t], (target[3], target[7], target[11])
    far = length(x)
    if not is_finite(far):
        return NO_POSE
    if terms.kind[t] == AXIS and terms.towards[t] == 0:
        if not far > 0.0:
            return NO_POSE
        x = times(1.0 / far, x)
    write(goal, 0, x)
    return 0


@jit
def aim(terms: Any, given: Any, t: int, target: Any) -> int:
    """Let the goal of task t be that of a packed target, (29,): 0, NO_POSE or NO_GOAL; then all stays."""
    if given.begins[t] < 0 or terms.kind[t] == JOINT_PLACES:
        return NO_GOAL
    if terms.kind[t] != FRAME:
        return _aim_point(terms, t, target)
    for k in range(TARGET_TWIST, TARGET_SIZE - 1):
        if not is_finite(target[k]):
            return NO_POSE
    if terms.rows[t] & TURNS != 0:
        if not is_pose(target):
            return NO_POSE
    elif not (is_finite(target[3]) and is_finite(target[7]) and is_finite(target[11])):
        return NO_POSE
    onto, mount, turn = given.onto[t], given.mount[t], terms.turn[t]
    for r in range(3):
        a, b, c = onto[4 * r], onto[4 * r + 1], onto[4 * r + 2]
        terms.goal[t, r] = a * target[3] + b * target[7] + c * target[11] + onto[4 * r + 3]
        x = a * target[0] + b * target[4] + c * target[8]
        y = a * target[1] + b * target[5] + c * target[9]
        z = a * target[2] + b * target[6] + c * target[10]
        for k in range(3):
            turn[3 * r + k] = x * mount[3 * k] + y * mount[3 * k + 1] + z * mount[3 * k + 2]
    for k in range(6):
        terms.rate[t, k] = target[TARGET_TWIST + k]
        terms.rate_change[t, k] = target[TARGET_ACCELERATION + k]
    return 0


@jit
def aim_joints(terms: Any, t: int, n: int, q: Any) -> int:
    """Let the joints' places of task t be q, (n,): 0, NO_POSE or NO_GOAL; then all stays."""
    if terms.kind[t] != JOINT_PLACES:
        return NO_GOAL
    for i in range(n):
        if not is_finite(q[i]):
            return NO_POSE
    assign(terms.q_goal[t], q, n)
    return 0


@jit
def move_thing(scene: Any, k: int, T: Any, twist: Any) -> int:
    """Thing k of the scene is at T, (16,), and goes on with a twist along W, (6,): 0, or NO_POSE."""
    if not is_pose(T):
        return NO_POSE
    for i in range(6):
        if not is_finite(twist[i]):
            return NO_POSE
    for r in range(3):
        scene.place[k, r] = T[4 * r + 3]
        for c in range(3):
            scene.turn[k, 3 * r + c] = T[4 * r + c]
    assign(scene.twist[k], twist, 6)
    look_again(scene)
    scene.gap[:] = -inf
    scene.version += 1
    return 0
