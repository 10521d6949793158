"""Many QPs at once: rounds of chunks, verdicts before, multipliers after."""

from collections.abc import Callable
from typing import Final

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, SOLVED
from ftqp.qp.dtrnn.jax.arrays import device_kind, double
from ftqp.qp.dtrnn.jax.batch_iteration import RUNNING, Rule, State, advanced, looked_ahead
from ftqp.qp.dtrnn.jax.batch_network import Network, network
from ftqp.qp.dtrnn.jax.batch_stretch import STEADY
from ftqp.qp.dtrnn.jax.batch_verdicts import published, verdicts

CHUNK_BYTES: Final = {"cpu": 2**21, "gpu": 2**30}
"""Size of Gamma of the problems that iterate together: what a CPU's cache, or a GPU's memory, holds well."""
SMALLEST: Final = 64
"""So few problems iterate to their end together."""


def _round(
    data: list[FloatArray], state: State, chunk: int, advance: Callable[[Network, State, int], State]
) -> None:
    """Advance the problems that run, of a state held in numpy, ``chunk`` of them at a time.

    Array code works on all of a chunk until its last problem ends. So a round leaves behind the few that take
    longest, and the next round takes together what all chunks left behind.
    """
    remaining = np.flatnonzero(state.code == RUNNING)
    for first in range(0, len(remaining), chunk):
        some = remaining[first : first + chunk]
        count = len(some)
        # Powers of two, so that few shapes are compiled; what fills them up has ended.
        size = chunk if len(remaining) > chunk else max(SMALLEST, 1 << (count - 1).bit_length())
        padded = [
            np.pad(part[some], [(0, size - count)] + [(0, 0)] * (part.ndim - 1)) for part in (*data, *state)
        ]
        own = State(*padded[len(data) :])
        own.code[count:] = SOLVED
        end = advance(network(*padded[: len(data)]), own, count // 2 if count > SMALLEST else 0)
        for whole, part in zip(state, end, strict=True):
            whole[some] = np.asarray(part)[:count]


def solve_batch(
    H: FloatArray,
    g: FloatArray,
    A: FloatArray,
    b: FloatArray,
    C: FloatArray,
    l: FloatArray,
    u: FloatArray,
    lb: FloatArray,
    ub: FloatArray,
    *,
    method: str,
    scaling: bool,
    newton: bool,
    gamma: float,
    tolerance: float,
    max_iterations: int,
    paper: bool,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, IntArray, IntArray, FloatArray]:
    """Solve B QPs, each cold, on JAX's default device; one problem's data never change another's answer.

    Args:
        H: Hessians, (B or 1, n, n); length 1 of any part is for all.
        g: Linear terms, (B or 1, n).
        A: Equality rows, (B or 1, m, n).
        b: Their right sides, (B or 1, m).
        C: Two-sided rows, (B or 1, p, n).
        l: Their lower bounds, (B or 1, p).
        u: Their upper bounds, (B or 1, p).
        lb: Lower bounds of x, (B or 1, n).
        ub: Upper bounds of x, (B or 1, n).
        method: ``94lvi``, ``e47`` or ``implicit``.
        scaling: Whether to scale objective and rows.
        newton: Whether to jump.
        gamma: Step length, 0 < gamma < 2.
        tolerance: Largest |e|; relative to 1 + |x| unless ``paper``.
        max_iterations: Cap.
        paper: Whether |e| <= tolerance alone is the end.

    Returns:
        x (B, n), y (B, m), z (B, p), z_box (B, n), codes of ``ftqp.kernel.layout.enums`` (B,), iterations
        (B,) and
        |e| (B,), by the convention of ``ftqp.QP``. Where there is no solution x and multipliers are NaN; NaN
        in the data or an indefinite H gives FAILED, crossed bounds INFEASIBLE.
    """
    given = (H, g, A, b, C, l, u, lb, ub)
    B, n, m, p = max(len(part) for part in given), g.shape[1], b.shape[1], l.shape[1]
    data = [np.broadcast_to(part, (B, *part.shape[1:])) for part in given]
    N, rule = n + p + m + p, Rule(n, m, p, method, scaling, newton, paper)
    verdict = verdicts(*data)
    code = np.where(verdict == SOLVED, RUNNING, verdict)
    none = np.zeros(B, bool)
    state = State(np.zeros((B, N)), code, np.zeros(B, int), np.zeros(B), np.full(B, STEADY), none)
    budget = CHUNK_BYTES.get(device_kind(), CHUNK_BYTES["gpu"]) // (8 * N * N)
    chunk = max(SMALLEST, 1 << max(budget, 1).bit_length() - 1)

    def further(net: Network, own: State, few: int) -> State:
        end: State = advanced(net, own, few, gamma, tolerance, max_iterations, rule)
        return end

    with double():
        if newton and not paper:
            _round(data, state, chunk, lambda net, own, few: looked_ahead(net, own, tolerance, rule))
        while (code == RUNNING).any():
            _round(data, state, chunk, further)
    x, y, z, z_box = published(data, state.u)
    for part in (x, y, z, z_box):
        part[(code == INFEASIBLE) | (code == FAILED)] = np.nan
    return x, y, z, z_box, code, state.iterations, state.residual
