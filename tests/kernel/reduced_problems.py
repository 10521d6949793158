"""Reduced problems of the closed forms, filled from arrays, solved by the kernel's entries."""

from typing import Any

import numpy as np

from ftqp.kernel.closed_forms.closed_form_tick import gather
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout import enums
from ftqp.kernel.maths.svd import svd

RULES = {rule.name.lower(): int(rule) for rule in enums.Rule}
"""What the memory is for, unless a problem has more joints: one class, compiled once."""


def problem(J: Any, xdot: Any, locked: Any = (), rates: Any = None) -> Memory:
    """A reduced problem with unscaled columns."""
    m, n = np.shape(J)
    reduced = Memory("reduced")
    P = reduced.fields
    P.m, P.n = m, n
    P.A[:m, :n], P.b[:m] = J, xdot
    for k, joint in enumerate(locked):
        P.failed[joint] = 1
        P.rate[joint] = 0.0 if rates is None else rates[k]
    return reduced


def decomposed(J: Any, xdot: Any = None, locked: Any = ()) -> Any:
    """The reduced problem with its SVD."""
    P = problem(J, np.zeros(len(J)) if xdot is None else xdot, locked).fields
    gather(P, P.A, P.b, 1.0)
    svd(P)
    return P


def solved(reduced: Memory, method: int = enums.PSEUDOINVERSE, rule: str = "row",
           limit: float = 0.0) -> Any:  # fmt: skip
    """x, (n,), and kappa."""
    P = reduced.fields
    P.method, P.rule, P.limit = method, RULES[rule], limit
    reduced.call("resolve_reduced")
    return P.x[: P.n].copy(), float(P.kappa)


def kappa_of(reduced: Memory, rule: str, limit: float) -> float:
    """kappa by the rule, whatever the undamped rates are."""
    P = reduced.fields
    P.rule, P.limit = RULES[rule], limit
    reduced.call("kappa")
    return float(P.kappa)
