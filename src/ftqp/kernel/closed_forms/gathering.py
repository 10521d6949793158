"""From the task's rows to the reduced problem, and from its solution to all joints."""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def gather(P: Any, A: Any, b: Any, scale: float) -> None:
    """J, right and f from rows scale A and right sides scale b, the failed joints and their rates."""
    f = 0
    for i in range(P.n):
        if not P.failed[i]:
            P.joint[f] = i
            f += 1
    P.f = f
    for k in range(P.m):
        row, J = A[k], P.J[k]
        for j in range(f):
            i = P.joint[j]
            J[j] = scale * P.column[i] * row[i]
        right = b[k]
        if f < P.n:
            for i in range(P.n):
                if P.failed[i]:
                    right -= row[i] * P.rate[i]
        P.right[k] = scale * right


@jit
def scatter(P: Any) -> None:
    """x of all joints from y of the working ones and the rates of the failed ones."""
    for i in range(P.n):
        P.x[i] = P.rate[i]
    for j in range(P.f):
        i = P.joint[j]
        P.x[i] = P.column[i] * P.y[j]
