"""The record: all that one planner knows, in one array element that compiled code reads in place.

Capacity is fixed (32 joints, 6 task rows, 33 QP variables), sizes are read at run time, so one compilation
serves every
robot. Fields of a group below share a purpose; ``f8`` unless another type is named. SI units.
"""

from typing import Any

import numpy as np

from ftqp.kernel.layout.enums import DELAYS, JOINTS, ROWS, TARGET_SIZE, VARIABLES

N = JOINTS
Shape = tuple[int, ...]

ROBOT: dict[str, Shape] = {
    "rotation": (
        N,
        9,
    ),  # joint frame in its predecessor's at q = 0, by rows; every joint moves along or about its z
    "translation": (N, 3),
    "mass": (N,),
    "com": (N, 3),  # in the joint's frame
    "inertia": (N, 6),  # about the com: xx xy xz yy yz zz
    "armature": (N,),  # rotor inertia seen at the joint
    "tip_rotation": (9,),
    "tip_translation": (3,),
    "gravity": (3,),
}
LIMITS: dict[str, Shape] = {
    "q_min": (N,),  # limits as believed now: a degraded joint's are scaled here
    "q_max": (N,),
    "v_max": (N,),
    "a_max": (N,),
    "tau_max": (N,),
    "a_brake": (N,),  # deceleration that viability may count on
}
TASK: dict[str, Shape] = {
    "row_scale": (6,),  # 1 for linear rows, the characteristic length for angular ones
    "axis": (9,),  # rotation whose z is the tool axis, in the tip frame (rows "position_axis")
    "target": (TARGET_SIZE,),
    "tip_measured": (4, 4),
    "error": (6,),  # position [m] and rotation vector [rad] from the tip to the target, along W
    "slack": (ROWS,),  # A x - b_task, in the units of the rows
    "b_task": (ROWS,),  # what the task asks for; b differs in lexicographic mode
    "g_task": (VARIABLES,),  # objective kept aside during the first stage of lexicographic mode
    "d_task": (VARIABLES,),
    "z_first": (N,),  # multipliers of the first stage: what keeps the task from being followed
    "z_box_first": (N,),
    "yielding": (6,),  # compliance of each component beside that of the task as a whole; 1 without priorities
    "turn": (6, 6),  # U of the reduced Jacobian when the rows are turned by directional damping
    "sigma": (6,),  # its singular values
    "damp": (6,),  # compliance of the turned rows, times H
    "feedback": (6,),  # kp e of each row, on a path; where it is blocked all but the velocity feedback
    "bend": (6,),  # x'' - Jdot q' of each row, on a path
}
CRITERIA: dict[str, Shape] = {
    "weight": (N,),
    "posture": (N,),
    "drive": (N,),  # velocity that the null space is drawn to
}
FAULTS: dict[str, Shape] = {
    "lock_rate": (N,),  # deceleration of a joint that is being locked
    "lock_velocity": (N,),  # its velocity by that model
    "damping": (N,),  # of a free-swinging joint [N m s/rad]
}
STATE: dict[str, Shape] = {
    "q": (N,),
    "v": (N,),
    "q_command": (N,),
    "v_command": (N,),
    "a_command": (N,),
    "tau": (N,),
    "tau_brake": (N,),
}
KINEMATICS: dict[str, Shape] = {
    "sine": (N,),
    "cosine": (N,),
    "R": (N, 9),
    "o": (N, 3),
    "axis_w": (N, 3),  # joint axes along W
    "R_tip": (9,),
    "o_tip": (3,),
    "w": (N, 3),
    "alpha": (N, 3),
    "acc": (N, 3),  # of the frame origins, minus gravity
    "J": (6, N),
    "drift": (6,),
    "M": (N, N),
    "h": (N,),
}
BASE: dict[str, Shape] = {  # I is the inertial frame, see ``ftqp.kernel.rows.inertial_target``
    "tip_world": (4, 4),  # measured pose of the tip in I
    "base_given": (4, 4),  # measured pose of the base in I
    "base_rate": (6,),  # given twist of the base at its origin, along I
    "base_rate_last": (6,),
    "base_nominal": (9,),
    "base_now": (4, 4),  # pose of the base when it was measured
    "base_last": (4, 4),
    "T_base": (4, 4),  # the same brought to now
    "base_shift": (6,),  # displacement of the tip by the base in one sample, as observed
    "base_twist": (6,),  # twist of the tip by the base, predicted for the coming sample
    "base_error": (6,),  # from the tip to the target along I
    "base_turn": (9,),
    "base_tip": (9,),
    "base_product": (9,),
    "base_scratch": (6,),
    "arm_history": (DELAYS, 12),  # rotation and position of the tip in the base
    "setpoint": (N,),  # sum of the commands since the start
}
FLOATS = (
    "dt",
    "length",
    "kp",
    "kv",
    "slack_ratio",  # compliance of the task rows, relative to the QP's own magnitude
    "w_norm",  # criteria: 1/2 w_norm |x|^2_weight + x' (weight (norm_v v + norm_q (q - posture)))
    "norm_v",
    "norm_q",
    "w_inertia",  # 1/2 w_inertia x'M x + x'(inertia_v M v + inertia_h h)
    "inertia_v",
    "inertia_h",
    "w_torque",  # 1/2 w_torque |tau_H|^2, tau_H the torques of the joints that have not failed
    "jin_p",
    "jin_v",
    "jin_margin",
    "jin_upsilon",
    "stop_position",
    "stop_rotation",
    "last_position_error",
    "last_rotation_error",
    "position_error",
    "rotation_error",
    "scale",
    "accept",  # largest scaled residual that counts as solved
    "residual_task",
    "residual_bounds",
    "residual_dual",
    "torque_excess",
    "guard",  # share of a_max up to which torque limits hold without being checked; 0: torque rows every tick
    "observer",  # low-pass factor of the disturbance observer; 0: none
    "base_age",  # how long the base has not been seen
    "base_patience",  # how long it may not be seen
    "base_rank",
    "base_tolerance",
    "kappa",  # damping of a closed form
    "manipulability",  # gain of the gradient of log manipulability in the objective
    "damping_threshold",  # directional damping: singular value below which it begins
    "damping_factor",  # and its damping at the singularity; 0: none
    "progress",  # path time that has been reached [s]
    "rate",  # its derivative, in [0, 1]; negative: not known yet
    "path_stop",  # path time of the next jump of the twist
    "path_end",
    "rate_limit",  # largest rate allowed now
    "rate_ahead",  # largest rate from which the arm can stop before the next jump
    "rate_left",  # largest rate beside an error that the feedback no longer corrects
)
INTEGERS = (
    "n",
    "m",
    "p",
    "level",
    "mode",
    "bounds",
    "dynamic",  # torque rows, or an objective with inertia
    "has_torques",  # M, h and the torque rows are those of this tick
    "tool_rows",
    "uses_rotation",
    "nq",
    "has_tip_measured",
    "reset_mode",
    "is_reset",
    "latched",
    "stop_samples",
    "rising",
    "fallbacks",
    "fallback_limit",
    "status",
    "verdict",  # the status that the ladder is about to give
    "stage",
    "external",  # another solver takes the QP
    "network",  # address of the network's memory (``ftqp.kernel.entry.network_entries``), 0 without one
    "dense_task",
    "claim",
    "qp_iterations",
    "ticks",
    "empty_intervals",
    "base_moves",  # the target is given in I
    "base_attitude",
    "base_has",
    "base_delay",
    "base_ticks",
    "base_seen",
    "base_rates",
    "base_ever",
    "base_stale",
    "base_freezes",
    "base_hold",
    "base_leaning",
    "anti_windup",
    "resolver",  # address of the closed form's memory
    "on_path",  # the step under way is one along a path
    "interval",  # of the path's table
    "driven",  # the drive is not zero
    "turned",  # the task rows are along the singular directions
)
INTEGER_ARRAYS: dict[str, Shape] = {
    "prismatic": (N,),
    "continuous": (N,),
    "rows": (ROWS,),
    "fault": (N,),
    "lower_by": (N,),
    "upper_by": (N,),
}


def qp_fields(variables: int, rows: int, constraints: int) -> list[Any]:
    """Fields of a QP with compliant equality rows and of the active-set solver's memory.

    min 1/2 x'Hx + g'x + sum_k s_k^2/(2 soft_k),  Ax + s = b,  lb <= x <= ub,  l <= Cx <= u; a row with soft_k
    = 0 is hard.
    """
    working = variables + rows + constraints
    floats: dict[str, Shape] = {
        "H": (variables, variables),
        "H_diagonal": (variables,),
        "g": (variables,),
        "A": (rows, variables),
        "b": (rows,),
        "soft": (rows,),
        "C": (constraints, variables),
        "l": (constraints,),
        "u": (constraints,),
        "lb": (variables,),
        "ub": (variables,),
        "x": (variables,),
        "y": (rows,),
        "z": (constraints,),
        "z_box": (variables,),
        "x_free": (variables,),  # minimiser without rows; the solver's memory from here on
        "root": (variables,),  # 1/sqrt(H_ii), 0 for a fixed variable
        "root_of": (variables,),  # the H_ii whose root is kept, and the root
        "root_was": (variables,),
        "inverse": (variables,),  # the square of the root
        "L_H": (variables, variables),
        "scratch": (variables,),
        "V": (working, variables),  # rows of the working set times H^(-1/2)
        "G": (working, working),  # V V' + compliance
        "L": (working, working),  # its Cholesky factor, inverse diagonal
        "t": (working,),
        "lam": (working,),
        "lam_new": (working,),
        "warm_lam": (working,),
    }
    integers: dict[str, Shape] = {
        "code": (working,),
        "side": (working,),
        "active": (variables + constraints,),
        "warm_code": (working,),
        "warm_side": (working,),
    }
    return [
        *((name, "f8", shape) for name, shape in floats.items()),
        *((name, "f8") for name in ("soft_rows", "tolerance", "residual")),
        *((name, "i8", shape) for name, shape in integers.items()),
        *((name, "i8") for name in ("nx", "meq", "nc", "dense", "warm", "iterations", "max_iterations")),
    ]


def _planner_dtype() -> np.dtype[Any]:
    fields: list[Any] = [(name, "f8") for name in FLOATS] + [(name, "i8") for name in INTEGERS]
    for group in (ROBOT, LIMITS, TASK, CRITERIA, FAULTS, STATE, KINEMATICS, BASE):
        fields += [(name, "f8", shape) for name, shape in group.items()]
    fields += [(name, "i8", shape) for name, shape in INTEGER_ARRAYS.items()]
    return np.dtype(fields + qp_fields(VARIABLES, ROWS, JOINTS), align=True)


DTYPE = _planner_dtype()


def record(count: int = 1) -> Any:
    """``count`` records, zero but for ``yielding``; the address of record k is ``W[k:].ctypes.data``."""
    W = np.zeros(count, DTYPE)
    W["yielding"] = 1.0
    return W


def load_chain(W: Any, *, rotation: Any, translation: Any, mass: Any, com: Any, inertia: Any, prismatic: Any,
               continuous: Any, tip_rotation: Any, tip_translation: Any, gravity: Any,
               armature: Any = 0.0) -> None:  # fmt: skip
    """Write the constants of a serial chain into every record of ``W``.

    Args:
        W: records, (count,).
        rotation: (n, 3, 3). translation: (n, 3) [m]. mass: (n,) [kg]. com: (n, 3) [m]. inertia: (n, 3, 3) [kg
            m2].
        prismatic: (n,). continuous: (n,). tip_rotation: (3, 3). tip_translation: (3,) [m]. gravity: (3,)
            [m/s2].
        armature: (n,) rotor inertia at the joint [kg m2 or kg].
    """
    n = len(mass)
    W["n"] = n
    W["nq"] = n + int(np.count_nonzero(continuous))
    W["rotation"][:, :n] = np.reshape(rotation, (n, 9))
    W["translation"][:, :n] = translation
    W["mass"][:, :n] = mass
    W["com"][:, :n] = com
    upper = np.triu_indices(3)
    W["inertia"][:, :n] = np.asarray(inertia)[:, upper[0], upper[1]]
    W["armature"][:, :n] = armature
    W["prismatic"][:, :n] = prismatic
    W["continuous"][:, :n] = continuous
    W["tip_rotation"] = np.ravel(tip_rotation)
    W["tip_translation"] = tip_translation
    W["gravity"] = gravity
