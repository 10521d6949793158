"""What postures are worth: null vectors, manipulability without joints, and how hard joints would fall."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ftqp.analysis.goals import random_postures
from ftqp.analysis.survival.continuing import rows_session
from ftqp.core.checks import FloatArray, array, numbers
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot


def null_vector(J: Any) -> FloatArray:
    """The unit null vector n of J, (..., n), with det [n; J] > 0: a formula of J alone, without memory.

    So its sign is the same at the same posture, and it is continuous along a path wherever J has full rank.
    Multiplying rows of J by positive numbers, as another unit of length does, leaves it as it is.
    Source: docs/theory/coverage.md, "Null vector and minors".

    Args:
        J: Jacobians with one column more than rows, (..., n - 1, n).

    Raises:
        InputError: The shape is another one, or a number is not finite.
    """
    matrices = jacobians(J, spare=1)
    _, _, Vt = np.linalg.svd(matrices)
    u = Vt[..., -1, :]
    sign = np.sign(np.linalg.det(np.concatenate([u[..., None, :], matrices], axis=-2)))
    return np.asarray(u * np.where(sign == 0.0, 1.0, sign)[..., None])


def minors(J: Any) -> FloatArray:
    """Z_i = (-1)^(i+1) det(J without column i), i = 1 .. n, (..., n): w n, with w = sqrt(det(J J')).

    Z has the unit of w and is no direction of self-motion for a given speed; n is.
    Source: zhang2016, eq. 4, which leaves the sign out; docs/theory/coverage.md, "Null vector and minors".

    Args:
        J: Jacobians with one column more than rows, (..., n - 1, n).

    Raises:
        InputError: The shape is another one, or a number is not finite.
    """
    matrices = jacobians(J, spare=1)
    n = matrices.shape[-1]
    each = [(-1.0) ** i * np.linalg.det(np.delete(matrices, i, axis=-1)) for i in range(n)]
    return np.stack(each, axis=-1)


def jacobians(J: Any, *, spare: int | None = None) -> FloatArray:
    """J as an array (..., m, n) of finite numbers."""
    matrices = numbers("J", J, ", expected a Jacobian (m, n)")
    if matrices.ndim < 2 or matrices.shape[-1] < matrices.shape[-2]:
        raise InputError(
            f"J has shape {matrices.shape}, expected (m, n) with at least as many columns as rows"
        )
    m, n = matrices.shape[-2:]
    if spare is not None and n - m != spare:
        raise InputError(
            f"J has shape ({m}, {n}), expected one column more than rows; with more joints to spare take "
            "relative_manipulability"
        )
    if not np.isfinite(matrices).all():
        raise InputError("J is not finite, expected numbers")
    return matrices


NOTHING = 1e-12
"""A share of manipulability below this is none."""


def relative_manipulability(J: Any, failed: Sequence[Sequence[int]] | None = None) -> FloatArray:
    """w(J without the columns F)/w(J) for each set F of joints, (..., sets), 0 to 1, w = sqrt(det(J J')).

        sqrt(det (1 - J^+ J)_FF) = the product of the singular values of the rows F of N

    The columns of N are an orthonormal basis of the self-motions. With one joint to spare it is the size of
    the entries of the unit null vector. Units of rows do not matter.
    Source: roberts1996; docs/theory/coverage.md, "Null vector and minors".

    Args:
        J: Jacobians, (..., m, n).
        failed: Sets of joints by 0-based index; None is each joint alone.

    Raises:
        InputError: J is no Jacobian, or a set is empty or has a joint that there is not.
    """
    matrices = jacobians(J)
    _, _, Vt = np.linalg.svd(matrices)
    N = np.swapaxes(Vt[..., matrices.shape[-2] :, :], -1, -2)
    sets = [(i,) for i in range(matrices.shape[-1])] if failed is None else list(failed)
    found = []
    for joints in sets:
        F = _indices(joints, matrices.shape[-1])
        if len(F) > N.shape[-1]:
            found.append(np.zeros(matrices.shape[:-2]))
        elif len(F) == 1:
            found.append(np.linalg.norm(N[..., F[0], :], axis=-1))
        else:
            found.append(np.linalg.svd(N[..., F, :], compute_uv=False).prod(axis=-1))
    return np.stack(found, axis=-1)


def velocity_jump(J: Any, v: Any, joint: int) -> FloatArray:
    """v+ - v when a joint that moves is locked at once and the task's velocity stays, (n,) [rad/s or m/s].

        v+ - v = -P e_j v_j / P_jj,  P = 1 - J^+ J,  of length |v_j| / sqrt(P_jj)

    It is the only jump with one joint to spare, and the smallest with more. Where the joint is needed it has
    no answer, and the entries are infinite.
    Source: docs/theory/coverage.md, "The velocity jump".

    Args:
        J: The Jacobian, (m, n).
        v: Velocities before the lock, (n,) [rad/s or m/s].
        joint: The joint that locks, its 0-based index.

    Raises:
        InputError: J is no Jacobian, v has another length, or there is no such joint.
    """
    matrix = jacobians(J)
    if matrix.ndim != 2:
        raise InputError(f"J has shape {matrix.shape}, expected (m, n)")
    speed = array("v", v, (matrix.shape[1],), "(n,)")
    j = int(_indices((joint,), matrix.shape[1])[0])
    P = _projector(matrix)
    if not P[j, j] > NOTHING:
        return np.zeros(len(speed)) if speed[j] == 0.0 else np.full(len(speed), np.inf)
    return np.asarray(-P[:, j] * speed[j] / P[j, j])


def _projector(J: FloatArray) -> FloatArray:
    """1 - J^+ J, (..., n, n), of the rows that move independently."""
    _, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    kept = sigma > NOTHING * sigma[..., :1]
    V = np.where(kept[..., None], Vt, 0.0)
    return np.asarray(np.eye(J.shape[-1]) - np.swapaxes(V, -1, -2) @ V)


def _indices(joints: Iterable[int], n: int) -> Any:
    found = np.array(sorted({int(i) for i in joints}), dtype=np.int64)
    if not len(found) or found[0] < 0 or found[-1] >= n:
        raise InputError(f"failed has the set {list(joints)}, expected joints by index from 0 to {n - 1}")
    return found


POSTURES = 200
"""Random postures that are looked at."""
NONE = 1e-9
"""A relative manipulability below this is none."""


def structural_joints(robot: Robot, rows: Any = "pose") -> tuple[str, ...]:
    """Names of the joints without which the task rows cannot be moved in any posture.

    They are those whose relative manipulability is below 1e-9 in 200 random postures within the limits, as
    the elbow of an arm with spherical shoulder and wrist and a pose: locked, it fixes the distance between
    both. With as many joints as rows all of them are.
    Source: docs/theory/coverage.md, "Why n_j is not the criterion".

    Args:
        robot: The arm.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, ``"position_axis"`` for
            position and tool axis, or names of rows.

    Raises:
        InputError: The rows are unknown or more than joints.
    """
    share = relative_manipulability(random_jacobians(robot, rows, POSTURES))
    return tuple(joint for joint, least in zip(robot.joints, share.T, strict=True) if least.max() < NONE)


def random_jacobians(robot: Robot, rows: Any, count: int) -> FloatArray:
    """Jacobians of task rows at random postures within the limits, the same every time, (count, m, nv)."""
    q = random_postures(robot, count)
    session = rows_session(robot, rows)
    if not session.S.study.axis:
        return session.values(q)[1]
    found = []
    for one in q:  # the rows of a tool axis are those of its goal
        session.aim(robot.pose(one))
        found.append(session.values(one[None])[1][0])
    return np.array(found)


EVALUATIONS = 24
"""Gravity is looked at in so many places of a joint's way."""


def fall_energy(robot: Robot, q: Any) -> dict[str, float]:
    """The energy [J] with which each joint alone, the remaining ones held, falls onto its stop.

    W_i = -int g_i dq_i from q_i downhill to the stop, friction left out; 0 where the joint swings back before
    it reaches the stop, and where it has none. A posture with little energy in it is a safer place to wait.
    Source: docs/theory/free-swinging.md, "The posture before".

    Args:
        robot: The arm; it has masses.
        q: The posture, (nv,) joint values or (nq,) [rad or m].

    Returns:
        The energy by joint name [J].

    Raises:
        InputError: The robot has no masses, or q has a wrong shape.
    """
    if not robot.has_inertia:
        raise InputError(f"{robot.name} has no inertia, so no joint falls; give the model its masses")
    posture = robot.angles(q)
    arm = ArmSession(robot.chain.constants())
    return {joint: _fall(arm, robot, posture, i) for i, joint in enumerate(robot.joints)}


def _fall(arm: ArmSession, robot: Robot, posture: FloatArray, i: int) -> float:
    """The energy of joint i."""
    g = _gravity(arm, posture, i)
    stop = float(robot.limits.q_min[i] if g > 0.0 else robot.limits.q_max[i])
    if g == 0.0 or not np.isfinite(stop):
        return 0.0
    way = np.linspace(posture[i], stop, EVALUATIONS)
    moved = posture.copy()
    torques = np.empty(EVALUATIONS)
    for k, moved[i] in enumerate(way):
        torques[k] = _gravity(arm, moved, i)
    mean = 0.5 * (torques[1:] + torques[:-1])
    gained = -np.cumsum(mean * np.diff(way))
    return float(gained[-1]) if (gained > 0.0).all() else 0.0


def _gravity(arm: ArmSession, q: FloatArray, i: int) -> float:
    """Gravity's torque on joint i."""
    arm.dynamics(q)
    return float(arm.K.kinematics.h[i])
