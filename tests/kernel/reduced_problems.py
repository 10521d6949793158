"""Reduced problems of the closed forms, filled from arrays, solved by the kernel's entries."""

from typing import Any

import numpy as np

from ftqp.control.first_use import warm_up_rates
from ftqp.kernel.closed_forms.reduced_problem import DTYPE, gather, memory
from ftqp.kernel.entry import entries as entry
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.maths.svd import svd

RULES = {"bound": codes.BOUND, "bound_2": codes.BOUND_2, "tight": codes.TIGHT, "row": codes.ROW,
         "exact_2": codes.EXACT_2, "exact_inf": codes.EXACT_INF}  # fmt: skip


@jit
def _decompose(address: int) -> None:
    P = carray(pointer(address), 1, DTYPE)[0]
    gather(P, P.A, P.b, 1.0)
    svd(P)


def problem(J: Any, xdot: Any, locked: Any = (), rates: Any = None) -> Any:
    """A reduced problem with unscaled columns."""
    warm_up_rates()
    P = memory()
    m, n = np.shape(J)
    P["m"], P["n"] = m, n
    P["A"][0, :m, :n], P["b"][0, :m] = J, xdot
    for k, joint in enumerate(locked):
        P["failed"][0, joint] = 1
        P["rate"][0, joint] = 0.0 if rates is None else rates[k]
    return P


def decomposed(J: Any, xdot: Any = None, locked: Any = ()) -> Any:
    """The reduced problem with its SVD."""
    P = problem(J, np.zeros(len(J)) if xdot is None else xdot, locked)
    _decompose(P.ctypes.data)
    return P


def solved(P: Any, method: int = codes.PSEUDOINVERSE, rule: str = "row", limit: float = 0.0) -> Any:
    """x, (n,), and kappa."""
    P["method"], P["rule"], P["limit"] = method, RULES[rule], limit
    entry.resolve_reduced(P.ctypes.data)
    return P["x"][0, : int(P["n"][0])].copy(), float(P["kappa"][0])


def kappa_of(P: Any, rule: str, limit: float) -> float:
    """kappa by the rule, whatever the undamped rates are."""
    P["rule"], P["limit"] = RULES[rule], limit
    entry.damping(P.ctypes.data)
    return float(P["kappa"][0])
