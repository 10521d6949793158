"""What a planner is told between its steps, one factory for each thing that it can be told.

Arguments that end in ``_at`` are addresses of memory that the caller keeps alive. Python and C call the same.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.compiled.taking import take
from ftqp.kernel.feedback.late_loop import miss
from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.latches.giving_up import give_up as give_rows_up
from ftqp.kernel.layout.enums import NOT_READ, TARGET_SIZE
from ftqp.kernel.layout.record import arm_dtype, path_dtype, record_dtype
from ftqp.kernel.layout.thresholds import MOST_ROWS
from ftqp.kernel.layout.told_memory import FAULT, LOAD, RESERVE, given_dtype
from ftqp.kernel.told.believed import begin_to_believe
from ftqp.kernel.told.believed import believe as believe_fault
from ftqp.kernel.told.load import carry as carry_load
from ftqp.kernel.told.load import load as load_arm
from ftqp.kernel.told.path_start import begin as begin_at_start
from ftqp.kernel.told.reserve import count_on as count_on_reserve
from ftqp.kernel.told.reserve import reserve, sample
from ftqp.kernel.told.starting import start as start_anew
from ftqp.kernel.told.stops import ask_for_brake as ask_for_brake_of
from ftqp.kernel.told.stops import hold_up as hold_up_arm
from ftqp.kernel.told.stops import resume as resume_from_stop
from ftqp.kernel.told.stops import stop as stop_arm

FLOAT = np.dtype(np.float64)


def believe(capacity: int) -> Callable[..., int]:
    """A fault of a joint, or that it works."""
    dtype, given = record_dtype(capacity), given_dtype(capacity)

    def believe(address: int, given_at: int, fault_at: int, goes_on: int) -> int:
        K, G = carray(pointer(address), 1, dtype)[0], carray(pointer(given_at), 1, given)[0]
        believe_fault(K.faults, K.limits, G, carray(pointer(fault_at), 1, FAULT)[0], goes_on)
        return 0

    return believe


def believed(capacity: int) -> Callable[..., int]:
    """What begins anew after faults were told."""
    dtype, given = record_dtype(capacity), given_dtype(capacity)

    def believed(address: int, given_at: int) -> int:
        begin_to_believe(carray(pointer(address), 1, dtype)[0], carray(pointer(given_at), 1, given)[0])
        return 0

    return believed


def sample_reserve(capacity: int) -> Callable[..., int]:
    """|h| and |M| of an arm at so many states, the rows at an address."""
    dtype = arm_dtype(capacity)

    def sample_reserve(arm_at: int, rows_at: int, samples: int) -> int:
        A = carray(pointer(arm_at), 1, dtype)[0]
        n = A.chain.n
        sample(A, carray(pointer(rows_at), (samples, n * (n + 3)), FLOAT))
        return 0

    return sample_reserve


def reserve_shares(capacity: int) -> Callable[..., int]:
    """The shares of a braking reserve for limits of n joints."""

    def reserve_shares(
        rows_at: int, samples: int, n: int, a_max_at: int, tau_max_at: int, out_at: int
    ) -> int:
        a_max, tau_max = carray(pointer(a_max_at), (n,), FLOAT), carray(pointer(tau_max_at), (n,), FLOAT)
        rows = carray(pointer(rows_at), (samples, n * (n + 3)), FLOAT)
        reserve(rows, n, a_max, tau_max, carray(pointer(out_at), 1, RESERVE)[0])
        return 0

    return reserve_shares


def count_on(capacity: int) -> Callable[..., int]:
    """The deceleration that braking counts on under the limits believed now; no samples: of all of it."""
    dtype, given = record_dtype(capacity), given_dtype(capacity)

    def count_on(address: int, given_at: int, rows_at: int, samples: int, out_at: int) -> int:
        K, G = carray(pointer(address), 1, dtype)[0], carray(pointer(given_at), 1, given)[0]
        n = K.chain.n
        rows = carray(pointer(rows_at), (samples, n * (n + 3)), FLOAT)
        count_on_reserve(K, G, rows, carray(pointer(out_at), 1, RESERVE)[0])
        return 0

    return count_on


def hold_up(capacity: int) -> Callable[..., int]:
    """1 where a joint that has lost torque cannot hold the arm, which is then stopped; else 0."""
    dtype, arm = record_dtype(capacity), arm_dtype(capacity)

    def hold_up(address: int, arm_at: int, joint: int) -> int:
        K, A = carray(pointer(address), 1, dtype)[0], carray(pointer(arm_at), 1, arm)[0]
        return 1 if hold_up_arm(K, A, joint) else 0

    return hold_up


def ask_for_brake(capacity: int) -> Callable[..., int]:
    """The brake of a joint is asked for."""
    dtype = record_dtype(capacity)

    def ask_for_brake(address: int, joint: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        ask_for_brake_of(K.watch, K.feedback, joint)
        return 0

    return ask_for_brake


def start(capacity: int) -> Callable[..., int]:
    """A planner begins at a state, all but its beliefs forgotten."""
    dtype, given = record_dtype(capacity), given_dtype(capacity)

    def start(address: int, given_at: int, q_at: int, v_at: int) -> int:
        K, G = carray(pointer(address), 1, dtype)[0], carray(pointer(given_at), 1, given)[0]
        n = K.chain.n
        start_anew(K, G, carray(pointer(q_at), (n,), FLOAT), carray(pointer(v_at), (n,), FLOAT))
        return 0

    return start


def stop(capacity: int) -> Callable[..., int]:
    """A stop is latched, for a ``StopReason``, if none is."""
    dtype = record_dtype(capacity)

    def stop(address: int, reason: int) -> int:
        stop_arm(carray(pointer(address), 1, dtype)[0].watch, reason)
        return 0

    return stop


def resume(capacity: int) -> Callable[..., int]:
    """1 where a stop is released, 0 where something forbids it."""
    dtype = record_dtype(capacity)

    def resume(address: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        return 1 if resume_from_stop(K.watch, K.feedback, K.chain) else 0

    return resume


def carry(capacity: int) -> Callable[..., int]:
    """Record and arm with a load at the tip."""
    dtype, arm, given = record_dtype(capacity), arm_dtype(capacity), given_dtype(capacity)

    def carry(address: int, arm_at: int, given_at: int, load_at: int) -> int:
        K, A = carray(pointer(address), 1, dtype)[0], carray(pointer(arm_at), 1, arm)[0]
        G, load = carray(pointer(given_at), 1, given)[0], carray(pointer(load_at), 1, LOAD)[0]
        load_arm(A.chain, G, load)
        carry_load(K, G, load)
        return 0

    return carry


def begin_path(capacity: int) -> Callable[..., int]:
    """A path that is followed by its progress begins anew."""
    dtype = path_dtype(capacity)

    def begin_path(path_at: int) -> int:
        begin_at_start(carray(pointer(path_at), 1, dtype)[0])
        return 0

    return begin_path


def give_up(capacity: int) -> Callable[..., int]:
    """The next set of rows of the task is given up: 1, or 0 where no more may be."""
    dtype = record_dtype(capacity)

    def give_up(address: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        return 1 if give_rows_up(K.task, K.terms, K.qp) else 0

    return give_up


def miss_tick(capacity: int) -> Callable[..., int]:
    """The next tick is one that a late loop has missed: 0 and what it is given, or a mistake."""
    dtype = record_dtype(capacity)

    def miss_tick(
        address: int, target: Any, row: int, left: int, q_at: int, later_at: int, out_at: int
    ) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        later, out = (
            carray(pointer(later_at), (TARGET_SIZE,), FLOAT),
            carray(pointer(out_at), (TARGET_SIZE,), FLOAT),
        )
        if row < 0 or row > MOST_ROWS:
            return NOT_READ
        if take(target, row * TARGET_SIZE, later_at, TARGET_SIZE, 0) < TARGET_SIZE:
            return NOT_READ
        miss(K, later, left, carray(pointer(q_at), (K.chain.n,), FLOAT), out)
        return 0

    return miss_tick
