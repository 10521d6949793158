"""How near the arm is to losing a direction of its task."""

from math import inf
from typing import Any

from ftqp.kernel.closed_forms.reduced_problem import gather
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.rows.task_rows import task_rows


@jit
def measure(K: Any, P: Any) -> None:
    """sigma_m, the product of all sigma and sigma_1/sigma_m of the task's Jacobian over the working joints.

    Linear rows are divided by the characteristic length. With fewer working joints than rows a direction of
    the task is lost: sigma_m = 0. The product is sqrt(det J J') (Yoshikawa 1985).
    """
    chain, faults, task, qp = K.chain, K.faults, K.task, K.qp
    P.n, P.m = chain.n, task.m
    for k in range(chain.n):
        i = faults.order[k]
        P.failed[i] = 0 if k < faults.working else 1
        P.rate[i] = 0.0
    task_rows(K, task.kp)  # those of a tick that stopped, too
    gather(P, qp.A, qp.b, 1.0 / task.length)
    svd(P)
    product = 1.0 if P.r == P.m else 0.0
    for k in range(P.r):
        product *= P.sigma[k]
    P.manipulability = product
    P.sigma_min = P.sigma[P.m - 1] if P.r == P.m else 0.0
    P.condition = P.sigma[0] / P.sigma_min if P.sigma_min > 0.0 else inf
