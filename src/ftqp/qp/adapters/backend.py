"""What a QP solver is to the rest of ftqp: its arrays, its settings, and one call again and again."""

import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature
from types import NoneType
from typing import Any, ClassVar, Self, TypeVar, final, get_args, get_type_hints

import numpy as np

from ftqp.core.checks import FloatArray, non_negative, positive
from ftqp.core.errors import InputError, nearest, unknown
from ftqp.kernel.layout.enums import Claim as Claim
from ftqp.qp.problem import Sized


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QPBuffers(Sized):
    """One QP and its solution as preallocated arrays.

    min 1/2 x'Hx + g'x, Ax = b, l <= Cx <= u, lb <= x <= ub.

    The content changes every tick, the shapes never do. Everything a solver wants in one piece lies in one
    piece: the rows are stacked as [A; C], bounds and multipliers as [box; equality; two-sided], and ``A``,
    ``b``, ``C``, ... are contiguous views of the stacks. Write ``b``; its copy inside ``upper``
    is the backend's business. Made by ``zeros``.

    Attributes:
        flat: The whole problem in one piece, matrices by rows: [H; g; A; C; lb; b; l; ub; b; u].
        data: Its first part, [H; g; A; C], (n * n + n + (m + p) * n,).
        bounds: Its second part, [lower; upper], (2 * (n + m + p),).
        solution: [x; z_box; y; z] in one piece, (2 * n + m + p,).
        H: Hessian, (n, n), symmetric.
        g: Linear term, (n,).
        rows: [A; C], (m + p, n).
        lower: [lb; b; l], (n + m + p,), -inf is no bound.
        upper: [ub; b; u], (n + m + p,), inf is no bound.
        A: Equality rows, (m, n).
        b: Their right side, (m,).
        C: Two-sided rows, (p, n).
        l: Their lower bounds, (p,).
        u: Their upper bounds, (p,); ``l == u`` is an equality.
        lb: Lower bounds of x, (n,).
        ub: Upper bounds of x, (n,); ``lb == ub`` fixes a variable.
        x: Solution, (n,).
        multipliers: [z_box; y; z], (n + m + p,).
        y: Multipliers of Ax = b, (m,).
        z: Multipliers of the two-sided rows, (p,), > 0 at an upper bound, < 0 at a lower one.
        z_box: Multipliers of the bounds of x, (n,), same signs.
        constant_hessian: Whether ``H`` keeps its values between solves, so that a warm solve may skip it.
    """

    flat: FloatArray
    data: FloatArray
    bounds: FloatArray
    solution: FloatArray
    H: FloatArray
    g: FloatArray
    rows: FloatArray
    lower: FloatArray
    upper: FloatArray
    A: FloatArray
    b: FloatArray
    C: FloatArray
    l: FloatArray
    u: FloatArray
    lb: FloatArray
    ub: FloatArray
    x: FloatArray
    multipliers: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    constant_hessian: bool = False

    @classmethod
    def zeros(cls, n: int, m: int, p: int, *, constant_hessian: bool = False) -> Self:
        """Buffers with H = I, no bounds, and zero elsewhere.

        Args:
            n: Number of variables, >= 1.
            m: Number of equality rows, >= 0.
            p: Number of two-sided rows, >= 0.
            constant_hessian: Whether ``H`` keeps its values between solves, so that a warm solve may skip it.

        Raises:
            InputError: There are no variables, or a count is negative.
        """
        if n < 1 or m < 0 or p < 0:
            raise InputError(f"a QP cannot have n = {n}, m = {m}, p = {p}; expected n >= 1, m >= 0, p >= 0")
        k = n + m + p
        size = n * n + n + (m + p) * n
        flat, solution = np.zeros(size + 2 * k), np.zeros(n + k)
        data, bounds = flat[:size], flat[size:]
        H, g, rows = data[: n * n].reshape(n, n), data[n * n : n * n + n], data[n * n + n :].reshape(m + p, n)
        lower, upper, multipliers = bounds[:k], bounds[k:], solution[n:]
        H[np.diag_indices(n)] = 1.0
        lower[:n] = lower[n + m :] = -np.inf
        upper[:n] = upper[n + m :] = np.inf
        return cls(
            flat=flat, data=data, bounds=bounds, solution=solution, H=H, g=g, rows=rows, lower=lower,
            upper=upper, A=rows[:m], b=lower[n : n + m], C=rows[m:], l=lower[n + m :], u=upper[n + m :],
            lb=lower[:n], ub=upper[:n], x=solution[:n], multipliers=multipliers, y=multipliers[n : n + m],
            z=multipliers[n + m :], z_box=multipliers[:n], constant_hessian=constant_hessian,
        )  # fmt: skip


UNSOLVED = (Claim.MAX_ITERATIONS, Claim.FAILED)
"""What a solver may say that was cut short by its time limit."""
MOST_ITERATIONS = 2**31 - 1
"""Iterations are reported up to this number."""

_LOG = logging.getLogger(__name__)


class _Flags:
    """Booleans that numpy writes and Python searches; ``0 in memory`` is much faster than ``array.all()``."""

    def __init__(self, count: int) -> None:
        self.memory = bytearray(count)
        self.array = np.frombuffer(self.memory, dtype=np.bool_)


class Backend(ABC):
    """A QP solver behind the one interface that planners drive.

    ``solve`` reads the buffers given to ``setup`` and writes ``x, y, z, z_box`` into them, with the
    multipliers of L = 1/2 x'Hx + g'x + y'(Ax - b) + z'Cx + z_box'x. Whatever the data are, it returns a
    claim and never raises:

    - data with NaN, or infinite where a number belongs, are FAILED, crossed bounds INFEASIBLE, unasked;
    - an answer that is not finite is FAILED, whatever the solver calls it, and so is one with a claim or
      iterations of another kind, or an exception;
    - a warm start that does not end in SOLVED is repeated cold, once, unless it ran out of time; after a
      solve that did not end in SOLVED, and the first time, a solve is cold whatever is asked.

    The outputs are written for SOLVED and MAX_ITERATIONS and left alone otherwise. A solve that was cut short
    by a time limit is OUT_OF_TIME.

    Attributes:
        name: How users name the backend.
        settings: The solver's, as its adapter has them.
        iterations: Iterations of the last solve, in the solver's own counting.
        overran: Whether the last solve was cut short by a time limit.
    """

    package: ClassVar[str]
    """The distribution whose version is reported."""

    def __init__(self, name: str, settings: Any = None) -> None:
        self.name, self.settings = name, settings
        self.iterations = 0
        self.overran = False
        self._spent = 0
        """Iterations that the warm attempt of this solve has taken; a repeat may count them to its cap."""
        self._raised = False
        """Whether the last attempt raised, which is logged once, not every tick."""
        self._buffers: QPBuffers | None = None

    @final
    def setup(self, qp: QPBuffers) -> None:
        """Keep the buffers and prepare the solver for their size; their content does not matter yet.

        Args:
            qp: The buffers that every later ``solve`` reads and writes.

        Raises:
            InputError: The QP is larger than the solver can take.
        """
        n, m, k = qp.n, qp.m, len(qp.lower)
        self._buffers = qp
        self._stale = True
        self._b_above = qp.upper[n : n + m]
        self._numbers, self._solution, self._ordered = _Flags(len(qp.data)), _Flags(n + k), _Flags(k)
        self._sides = _Flags(m)
        self._prepare(qp)

    @final
    def solve(self, *, cold: bool) -> Claim:
        """Solve the QP that the buffers hold now.

        Args:
            cold: Whether to drop what is left of the last solve; False starts from it, which is faster where
                the QPs change little.

        Raises:
            InputError: ``setup`` has not been called.
        """
        qp = self._buffers
        if qp is None:
            raise InputError(
                f"backend {self.name!r} was asked to solve before setup(QPBuffers); call setup first"
            )
        self.iterations = self._spent = 0
        self.overran = False
        self._b_above[:] = qp.b
        cold = cold or self._stale
        self._stale = True
        refused = self._refusal(qp)
        if refused is not None:
            return refused
        claim = self._attempt(qp, cold)
        if claim is not Claim.SOLVED and not cold and not self.overran:
            self._spent = self.iterations
            claim = self._attempt(qp, True)
            self.iterations += self._spent
        self._stale = claim is not Claim.SOLVED
        return Claim.OUT_OF_TIME if self.overran and claim in UNSOLVED else claim

    def _refusal(self, qp: QPBuffers) -> Claim | None:
        """FAILED for NaN or infinite data, INFEASIBLE for crossed bounds, None for data fit for a solver."""
        np.isfinite(qp.data, self._numbers.array)
        np.isfinite(qp.b, self._sides.array)
        if 0 in self._numbers.memory or 0 in self._sides.memory:
            return Claim.FAILED
        np.less_equal(qp.lower, qp.upper, self._ordered.array)  # False for NaN, too
        if 0 in self._ordered.memory:
            return Claim.FAILED if np.isnan(qp.bounds).any() else Claim.INFEASIBLE
        return None

    def _attempt(self, qp: QPBuffers, cold: bool) -> Claim:
        try:
            claim = self._run(qp, cold)
            if claim.__class__ is not Claim:
                claim = Claim(claim)
            if self.iterations.__class__ is not int or not 0 <= self.iterations <= MOST_ITERATIONS:
                self.iterations = min(max(int(self.iterations), 0), MOST_ITERATIONS)
        except Exception:  # whatever a foreign solver throws is its failure; a control loop must go on
            if not self._raised:
                _LOG.warning("solver %r raised; its answer counts as failed", self.name, exc_info=True)
            self._raised, self.iterations = True, 0
            return Claim.FAILED
        self._raised = False
        if claim <= Claim.MAX_ITERATIONS:
            np.isfinite(qp.solution, self._solution.array)
            if 0 in self._solution.memory:
                return Claim.FAILED
        return claim

    @abstractmethod
    def _prepare(self, qp: QPBuffers) -> None:
        """Allocate the native solver for this size; do not rely on the content of the buffers."""

    @abstractmethod
    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        """Hand what the buffers hold to the native solver, solve, write the outputs and ``iterations``."""


T = TypeVar("T")
TIME_LIMIT = "time_limit"
"""What the setting is called by which a solver that has one ends in time."""
LARGEST_COUNT = 2**31 - 1
"""What a whole number of a solver's settings is at most: solvers hold them in 32 bits."""


def settings(kind: type[T], backend: str, given: Mapping[str, Any]) -> T:
    """``given`` as a dataclass: bools, ints >= 1, floats > 0 or, by default 0, >= 0, words."""
    known: dict[str, Any] = get_type_hints(kind)
    for name in given:
        if name == TIME_LIMIT and name not in known:
            remedy = "bound its time by max_iterations" if "max_iterations" in known else "leave it out"
            raise InputError(
                f"backend {backend!r} has no {TIME_LIMIT}: its solver does not look at a clock; {remedy}"
            )
        if name not in known:
            raise unknown("setting", name, f"backend {backend!r}", known)
    usual = signature(kind).parameters
    return kind(
        **{
            name: _setting(f"{backend}.{name}", x, known[name], usual[name].default)
            for name, x in given.items()
        }
    )


def _setting(name: str, value: Any, hint: Any, default: Any) -> Any:
    """A value that is of its field's type."""
    kinds = get_args(hint) or (hint,)
    if value is None and NoneType in kinds:
        return None
    if isinstance(kinds[0], str):
        if value not in kinds:
            words = ", ".join(kinds)
            raise InputError(f"{name} is {value!r}{nearest(str(value), kinds)}, expected one of {words}")
        return value
    if bool in kinds:
        if not isinstance(value, bool):
            raise InputError(f"{name} is {value!r}, expected true or false")
        return value
    if isinstance(value, bool | str):
        raise InputError(f"{name} is {value!r}, expected a number")
    if int in kinds:
        if not isinstance(value, int) or not 1 <= value <= LARGEST_COUNT:
            raise InputError(f"{name} is {value!r:.60}, expected a whole number from 1 to {LARGEST_COUNT}")
        return value
    return non_negative(name, value) if default == 0.0 else positive(name, value)
