"""How near the arm is to losing a direction of its task."""

from math import inf
from typing import Any

from ftqp.kernel.closed_forms.reduced_problem import gather
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.rows.task_rows import task_rows


@jit
def measure(K: Any, P: Any) -> None:
    """sigma_m, the product of all sigma and sigma_1/sigma_m of the task's Jacobian over the healthy joints.

    Linear rows are divided by the characteristic length. With fewer healthy joints than rows a direction of
    the task is lost: sigma_m = 0. The product is sqrt(det J J') (Yoshikawa 1985).
    """
    P.n, P.m = K.n, K.m
    for i in range(K.n):
        P.failed[i] = 1 if K.fault[i] != HEALTHY else 0
        P.rate[i] = 0.0
    task_rows(K)  # those of a tick that stopped, too
    gather(P, K.A, K.b, 1.0 / K.length)
    svd(P)
    product = 1.0 if P.r == P.m else 0.0
    for k in range(P.r):
        product *= P.sigma[k]
    P.manipulability = product
    P.sigma_min = P.sigma[P.m - 1] if P.r == P.m else 0.0
    P.condition = P.sigma[0] / P.sigma_min if P.sigma_min > 0.0 else inf
