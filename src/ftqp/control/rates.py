"""Closed forms without a planner: joint rates from a Jacobian and a task velocity."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ftqp.control.task.resolvers import Damping, positive_weights, rule_code
from ftqp.core.checks import FloatArray, array, positive
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout.enums import APPROXIMATE, DAMPED, JOINTS, PSEUDOINVERSE, TASK_ROWS

METHODS = {"pinv": PSEUDOINVERSE, "dls": DAMPED}
LINEAR = 3
"""The first rows of a Jacobian are linear, those after them angular."""
ZERO_BLOCK = 1e-9
"""Largest entry of the block that must vanish at a wrist centre, relative to the largest of all. A million
times the rounding of forward kinematics."""


def resolve_rates(
    J: Any,
    xdot: Any,
    locked: Iterable[int] = (),
    locked_rates: Any = None,
    method: str = "pinv",
    damping: Damping | None = None,
    limits: Any = None,
    characteristic_length: float | None = None,
    weights: Any = None,
) -> FloatArray:
    """Joint rates for a task velocity, with some joints locked or moving at known rates.

    pinv: S J_f^+ (xdot - J_l rates), the least sum weights_i v_i^2 among the solutions nearest to the task.
    dls: the same, damped by ``damping`` where it breaks ``limits``. The formulas are derived in
    ``docs/theory/singularities.md``.

    Args:
        J: The Jacobian, (m, n), linear rows first; at most 6 rows and 64 columns.
        xdot: The task velocity, (m,) [m/s, rad/s].
        locked: 0-based columns of the joints that have failed.
        locked_rates: Rates of those joints, one each [rad/s or m/s]; None holds them still.
        method: ``pinv`` or ``dls``.
        damping: The rule of ``dls``; None is ``Damping()``.
        limits: Rate limits of ``dls``, one or (n,), > 0 [rad/s or m/s]. Larger ones damp later.
        characteristic_length: The first three rows are divided by it, > 0 [m]. A larger one makes linear
            motion count less next to rotation. None uses the rows as they are.
        weights: Weights of the joints, (n,), > 0, for ``pinv`` only. The larger a weight, the less its joint
            moves.

    Returns:
        Rates, (n,) [rad/s or m/s]; those of locked joints exactly as given.

    Raises:
        InputError: A wrong shape, NaN, an unknown method, all joints locked, a Jacobian whose free columns
            are zero, or limits, weights or a length that are not positive.
    """
    reduced = _problem(J, xdot, locked, locked_rates, characteristic_length)
    P = reduced.fields
    n = int(P.n)
    if method not in METHODS:
        raise InputError(
            f"method is {method!r}{nearest(str(method), METHODS)}, expected one of {', '.join(METHODS)}"
        )
    P.method = METHODS[method]
    if method == "pinv":
        if limits is not None or damping is not None:
            raise InputError(
                "limits and damping go with method='dls' only; leave them out, or change the method"
            )
        if weights is not None:
            given = positive_weights(weights)
            if len(given) != n:
                raise InputError(f"weights have {len(given)} entries, expected one a joint: {n}")
            P.column[:n] = 1.0 / np.sqrt(given)
    else:
        if weights is not None:
            raise InputError("weights go with method='pinv' only; dls weighs the joints by their limits")
        if limits is None:
            raise InputError("method='dls' needs limits, one rate limit or one a joint")
        P.rule = rule_code((damping or Damping()).rule)
        _limit(P, limits)
    reduced.call("resolve_reduced")
    return np.array(P.x[:n])


def damping_factor(
    J: Any,
    xdot: Any,
    limit: Any,
    rule: str = "row",
    locked: Iterable[int] = (),
    characteristic_length: float | None = None,
) -> float:
    """The damping kappa that a rule gives for the reduced Jacobian, in squared units of its singular values.

    The rules ``row``, ``exact_2`` and ``exact_inf`` give 0 when the undamped rates keep the limit; the bounds
    (``bound``, ``bound_2``, ``tight``) are the formulas as they stand, to be used where they do not.

    Args:
        J: The Jacobian, (m, n), linear rows first.
        xdot: The task velocity, (m,) [m/s, rad/s].
        limit: Rate limit, one or (n,), > 0 [rad/s or m/s]. A larger one needs less damping.
        rule: The rule, see ``Damping``.
        locked: 0-based columns of the joints that have failed.
        characteristic_length: The first three rows are divided by it, > 0 [m]; None uses them as they are.

    Raises:
        InputError: As ``resolve_rates``.
    """
    reduced = _problem(J, xdot, locked, None, characteristic_length)
    P = reduced.fields
    P.rule = rule_code(rule)
    _limit(P, limit)
    reduced.call("kappa")
    return float(P.kappa)


def approximate_pinv(J_wrist: Any, sigma_min: float = 0.1) -> FloatArray:
    """J-dagger, (n, 6), of a Jacobian at the centre of a spherical wrist, [[B, 0], [D, E]], E (3, 3).

    [[B+, 0], [-E+ D B+, E+]], B+ and E+ without the singular values up to ``sigma_min``.

    Args:
        J_wrist: The Jacobian at the wrist centre, (6, n), linear rows first [m].
        sigma_min: Singular values up to this one are dropped, > 0 [m; without unit for E]. A larger one keeps
            farther from singularities and gives up more; it bounds no rate.

    Raises:
        InputError: A wrong shape, NaN, a threshold that is not positive, or an upper right block that is not
            zero.
    """
    reduced = _problem(J_wrist, np.zeros(TASK_ROWS), (), None, None)
    P = reduced.fields
    n, A = int(P.n), P.A
    P.threshold = positive("sigma_min", sigma_min, "m")
    if n < 4 or np.shape(J_wrist)[0] != TASK_ROWS:
        raise InputError(f"J_wrist has shape {np.shape(J_wrist)}, expected (6, n) with n >= 4")
    block = float(np.abs(A[:LINEAR, n - 3 : n]).max())
    if block > ZERO_BLOCK * float(np.abs(A[:, :n]).max()):
        raise InputError(
            f"the upper right block of J_wrist is not zero but up to {block:.3g}; "
            "give the Jacobian at the centre of the spherical wrist, linear rows first"
        )
    P.method = APPROXIMATE
    result = np.empty((n, TASK_ROWS))
    for k in range(TASK_ROWS):
        P.b[:] = 0.0
        P.b[k] = 1.0
        reduced.call("resolve_reduced")
        result[:, k] = P.x[:n]
    return result


def _problem(J: Any, xdot: Any, locked: Iterable[int], locked_rates: Any, length: float | None) -> Memory:
    """The kernel's memory with Jacobian, task velocity and failed joints."""
    shape = np.shape(J)
    if len(shape) != 2 or not 1 <= shape[0] <= TASK_ROWS or not 1 <= shape[1] <= JOINTS:
        raise InputError(
            f"J has shape {shape}, expected (m, n) with at most {TASK_ROWS} rows and {JOINTS} columns"
        )
    m, n = shape
    scale = np.ones(m)
    if length is not None:
        scale[:LINEAR] = 1.0 / positive("characteristic_length", length, "m")
    reduced = Memory("reduced")
    P = reduced.fields
    P.m, P.n = m, n
    P.A[:m, :n] = scale[:, None] * array("J", J, (m, n), "(m, n)")
    P.b[:m] = scale * array("xdot", xdot, (m,), "(m,)")
    columns = _columns(locked, n)
    P.failed[columns] = 1
    if locked_rates is not None:
        P.rate[columns] = array("locked_rates", locked_rates, (len(columns),))
    free = P.failed[:n] == 0
    if not free.any():
        raise InputError(f"all {n} joints are locked; nothing is left to move")
    if not P.A[:m, :n][:, free].any():
        raise InputError("J is zero in all columns of free joints, so they cannot move the task")
    return reduced


def _columns(locked: Iterable[Any], n: int) -> list[int]:
    columns: list[int] = []
    for joint in locked:
        if isinstance(joint, str):
            raise InputError(
                f"locked holds {joint!r}, but a Jacobian has no joint names; give 0-based columns: "
                "robot.joint(name)"
            )
        if not isinstance(joint, int | np.integer) or isinstance(joint, bool) or not 0 <= joint < n:
            raise InputError(f"locked holds {joint!r}, expected 0-based columns 0 to {n - 1}")
        if int(joint) in columns:
            raise InputError(f"locked holds {int(joint)} twice")
        columns.append(int(joint))
    return columns


def _limit(P: Any, limits: Any) -> None:
    """One limit, and columns relative to it."""
    n = int(P.n)
    if np.ndim(limits) == 0:
        P.limit = positive("the rate limit", limits, "rad/s")
        return
    values = array("limits", limits, (n,), "(n,)")
    for i, value in enumerate(values):
        positive(f"the rate limit of joint {i}", value, "rad/s")
    free = P.failed[:n] == 0
    P.limit = values[free].max()
    P.column[:n] = values / values[free].max()
