"""A whole tick with a closed form in the place of the QP, and closed forms without a planner."""

from collections.abc import Callable
from typing import Any

from ftqp.kernel.closed_forms.approximate_inverse import approximate_inverse
from ftqp.kernel.closed_forms.closed_form_tick import resolve
from ftqp.kernel.closed_forms.damping_factor import damping_factor
from ftqp.kernel.closed_forms.gathering import gather
from ftqp.kernel.closed_forms.pseudoinverses import closed_form
from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.layout.method_codes import APPROXIMATE
from ftqp.kernel.layout.record import base_dtype, record_dtype
from ftqp.kernel.layout.reduced_problem import reduced_dtype
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.ticks.steps import accept, settle_on_base
from ftqp.kernel.ticks.tick import prepare_on_base, prepare_plain


def closed_form_clock(capacity: int) -> Callable[..., int]:
    """A tick led by the clock."""
    dtype, problem = record_dtype(capacity), reduced_dtype(capacity)

    def closed_form_clock(address: int, memory_at: int, q: Any, v: Any, target: Any, row: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        return resolve(K, carray(pointer(memory_at), 1, problem)[0], prepare_plain(K))

    return closed_form_clock


def closed_form_base(capacity: int) -> Callable[..., int]:
    """A tick led by an inertial target above a base that moves."""
    dtype, lead, problem = record_dtype(capacity), base_dtype(capacity), reduced_dtype(capacity)

    def closed_form_base(
        address: int, memory_at: int, base_at: int, q: Any, v: Any, target: Any, row: int
    ) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        base = carray(pointer(base_at), 1, lead)[0]
        code = accept(K, q, v, target, row)
        if code < 0:
            return code
        code = resolve(K, carray(pointer(memory_at), 1, problem)[0], prepare_on_base(K, base))
        settle_on_base(K, base)
        return code

    return closed_form_base


def resolve_reduced(capacity: int) -> Callable[..., int]:
    """x of a reduced problem alone, by its method."""
    problem = reduced_dtype(capacity)

    def resolve_reduced(memory_at: int) -> int:
        P = carray(pointer(memory_at), 1, problem)[0]
        if P.method == APPROXIMATE:
            approximate_inverse(P)
        else:
            gather(P, P.A, P.b, 1.0)
            closed_form(P)
        return 0

    return resolve_reduced


def kappa(capacity: int) -> Callable[..., int]:
    """kappa of a reduced problem by its rule, whether or not the undamped rates break the limit."""
    problem = reduced_dtype(capacity)

    def kappa(memory_at: int) -> int:
        P = carray(pointer(memory_at), 1, problem)[0]
        gather(P, P.A, P.b, 1.0)
        svd(P)
        P.kappa = damping_factor(P)
        return 0

    return kappa
