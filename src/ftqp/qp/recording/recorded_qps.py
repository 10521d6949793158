"""Recorded QPs: a backend that keeps what it is asked, and the arrays with names and their file."""

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, Self, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray, frozen, positive, whole_number
from ftqp.core.errors import InputError
from ftqp.core.npz import read_npz, write_npz
from ftqp.core.whole_file import free_path
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers
from ftqp.qp.adapters.registry import backend as backend_of
from ftqp.qp.problem import ANSWER, PARTS, QP

FORMAT = 1
"""Version of the file's layout."""

SHAPES: dict[str, tuple[str, ...]] = {
    "H": ("n", "n"), "g": ("n",), "A": ("m", "n"), "b": ("m",), "C": ("p", "n"), "l": ("p",), "u": ("p",),
    "lb": ("n",), "ub": ("n",), "x": ("n",), "y": ("m",), "z": ("p",), "z_box": ("n",),
    "claim": (), "iterations": (), "cold": (), "tick": (), "time": (),
}  # fmt: skip
"""The arrays and their shapes behind the leading axis of K QPs."""
WHOLE = {"claim": np.int64, "iterations": np.int64, "tick": np.int64, "cold": np.bool_}
"""Arrays that are not of floats."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """K consecutive QPs of one shape, an answer to each, and what they mean.

    min 1/2 x'Hx + g'x, Ax = b, l <= Cx <= u, lb <= x <= ub, multipliers of L = f + y'(Ax - b) + z'Cx +
    z_box'x. The arrays are read-only.

    Attributes:
        H: Hessians, (K, n, n).
        g: Linear terms, (K, n).
        A: Equality rows, (K, m, n).
        b: Their right sides, (K, m).
        C: Two-sided rows, (K, p, n).
        l: Their lower bounds, (K, p).
        u: Their upper bounds, (K, p).
        lb: Lower bounds of x, (K, n).
        ub: Upper bounds of x, (K, n).
        x: The answers, (K, n); NaN where there is none.
        y: Multipliers of Ax = b, (K, m); NaN where there is no answer.
        z: Multipliers of the two-sided rows, (K, p); NaN where there is no answer.
        z_box: Multipliers of the bounds of x, (K, n); NaN where there is no answer.
        claim: What the solver said of its answer, a ``Claim`` each, (K,).
        iterations: Iterations of the solver, in its own counting, (K,).
        cold: Whether the solver was asked to forget the QP before, (K,).
        tick: Number of the control tick, rising, (K,).
        time: Time of the tick, (K,) [s].
        variables: Names of x, for a planner's QP the joints, ``scale``, ``slack x``, ..., (n,).
        rows: Names of [A; C], for a planner's QP ``x``, ``y``, ..., ``torque panda_joint1``, ..., (m + p,).
        metadata: Robot, scheme, level, faults, versions and whatever else JSON can hold.
    """

    H: FloatArray
    g: FloatArray
    A: FloatArray
    b: FloatArray
    C: FloatArray
    l: FloatArray
    u: FloatArray
    lb: FloatArray
    ub: FloatArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    claim: IntArray
    iterations: IntArray
    cold: BoolArray
    tick: IntArray
    time: FloatArray
    variables: tuple[str, ...]
    rows: tuple[str, ...]
    metadata: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Check the parts against each other."""
        for name in SHAPES:
            try:
                value: Any = np.array(getattr(self, name), dtype=WHOLE.get(name, float), order="C")
            except (TypeError, ValueError) as error:
                raise InputError(f"{name} is no array of numbers: {error}") from error
            object.__setattr__(self, name, frozen(value))
        sizes = {"n": self.g.shape[-1], "m": self.b.shape[-1], "p": self.l.shape[-1]}
        for name, shape in SHAPES.items():
            found, expected = getattr(self, name).shape, (len(self.g), *(sizes[size] for size in shape))
            if found != expected or not len(self.g):
                symbols = f"({', '.join(('K', *shape))})"
                raise InputError(f"{name} has shape {found}, expected {symbols} = {expected}, K >= 1")
        if (np.diff(self.tick) <= 0).any():
            raise InputError("tick does not rise from QP to QP")
        for name, count in (("variables", sizes["n"]), ("rows", sizes["m"] + sizes["p"])):
            words = tuple(getattr(self, name))
            if len(set(words)) != count or len(words) != count:
                raise InputError(f"{name} has {len(set(words))} different names, expected {count}")
            object.__setattr__(self, name, words)
        object.__setattr__(self, "metadata", dict(self.metadata))

    def __len__(self) -> int:
        return len(self.tick)

    def __iter__(self) -> Iterator[QP]:
        return (self.problem(k) for k in range(len(self)))

    def problem(self, k: int) -> QP:
        """The QP at a position.

        Args:
            k: The position, 0 to K - 1.

        Raises:
            InputError: Its H is indefinite.
        """
        return QP(**{name: getattr(self, name)[k] for name in PARTS})

    def part(self, begin: int, end: int) -> "Recording":
        """The QPs at positions ``begin`` to ``end - 1``; at least one.

        Args:
            begin: The first position.
            end: One beyond the last position.
        """
        return replace(self, **{name: getattr(self, name)[begin:end] for name in SHAPES})

    def position(self, tick: int) -> int:
        """The position of a tick.

        Args:
            tick: The number of a control tick.

        Raises:
            InputError: The tick was not recorded; the message names what was.
        """
        at = int(np.searchsorted(self.tick, tick))
        if at < len(self) and self.tick[at] == tick:
            return at
        closest = int(self.tick[np.argmin(np.abs(self.tick - tick))])
        gaps = "" if self.tick[-1] - self.tick[0] + 1 == len(self) else f" ({len(self)} of them)"
        raise InputError(
            f"tick {tick} was not recorded, expected one of {self.tick[0]} to {self.tick[-1]}{gaps}; "
            f"the nearest recorded one is {closest}"
        )

    def save(self, path: str | Path) -> None:
        """Write a new file, whole or not at all.

        Args:
            path: The file, which ends in ``.npz`` and does not exist yet.

        Raises:
            InputError: The file exists already or cannot be written, or the metadata are not JSON.
        """
        file = free_path(path, "recording", ".npz")
        about = {"variables": self.variables, "rows": self.rows, "format": FORMAT}
        arrays = {name: getattr(self, name) for name in SHAPES}
        try:
            write_npz(file, arrays, {**about, "metadata": self.metadata})
        except (TypeError, ValueError) as error:
            raise InputError(f"metadata of the recording are not JSON: {error}") from error
        except OSError as error:
            raise InputError(f"recording {file} cannot be written: {error.strerror or error}") from error

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """The recording in a file.

        Args:
            path: A file that ``save`` or ``ftqp run --record-qps`` has written.

        Raises:
            InputError: There is no such file, or it is no recording, of another version, cut off, or damaged.
        """
        file = Path(path)
        if not file.is_file():
            raise InputError(f"recording {file} does not exist; `ftqp run --record-qps FILE` makes one")
        try:
            arrays, about = read_npz(file)
            version = about.pop("format")
            if version == FORMAT:
                return cls(**arrays, **about)  # type: ignore[arg-type]
        except (OSError, KeyError, AttributeError, TypeError, ValueError, RecursionError) as error:
            raise InputError(
                f"{file} is not a recording, or is damaged ({error!s:.100}); expected the .npz of "
                "`ftqp run --record-qps`"
            ) from error
        raise InputError(
            f"recording {file} has format {version!r:.20}, this ftqp reads {FORMAT}; "
            "record it again with `ftqp run --record-qps`"
        )


MEMORY = 256 * 2**20
"""Bytes that the copies take at most unless ``limit`` says otherwise: 75 000 QPs of a Panda's pose task."""


class Ticking(Protocol):
    """Whoever numbers the QPs: a planner."""

    @property
    def tick(self) -> int:
        """Number of the tick that is being computed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kept:
    tick: int
    flat: FloatArray
    solution: FloatArray
    claim: Claim
    iterations: int
    cold: bool


@final
class Recorder(Backend):
    """Forwards to another backend and keeps copies of the QPs, their answers and the solver's claims.

    It changes no answer. When the memory is full the oldest QPs go: the last ones show why a run ended as it
    did. It keeps one run: a tick number that does not rise begins anew. QPs that no solver is asked to solve
    (NaN, crossed bounds; ticks of a stop) are not kept.

    Args:
        inner: The backend that solves, or anything that ``ftqp.qp.backend`` takes.
        every: One of so many ticks is kept, >= 1. A larger number covers a longer run in the same memory.
        limit: The most QPs that are kept, >= 1; None is as many as fit into 256 MiB.
        first: The first tick to keep, >= 0.
        last: The last tick to keep, >= first; None has no end.

    Raises:
        InputError: The backend is unknown, or a number is out of its range.
        MissingPackage: The solver's package is not installed.
    """

    package = "ftqp"

    def __init__(
        self,
        inner: str | Path | Mapping[str, Any] | Backend,
        every: int = 1,
        limit: int | None = None,
        *,
        first: int = 0,
        last: int | None = None,
    ) -> None:
        self.inner = backend_of(inner)
        if isinstance(self.inner, Recorder):
            raise InputError(f"{self.inner.name} records already; give the backend inside it")
        super().__init__(f"recorder:{self.inner.name}")
        whole_number("every", every, 1)
        whole_number("first", first, 0)
        for name, value, least in (("limit", limit, 1), ("last", last, first)):
            if value is not None:
                whole_number(name, value, least)
        self._every, self._limit = every, limit
        self._first, self._last = first, last
        self._kept: deque[_Kept] = deque()
        self._leader: Ticking | None = None
        self._dropped, self._solves, self._again = 0, 0, False

    def follow(self, leader: Ticking) -> None:
        """Number the QPs by the ticks of a planner; without one, solves are counted.

        Args:
            leader: The planner, or anything else with a ``tick``.
        """
        self._leader = leader

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def dropped(self) -> int:
        """How many of the oldest QPs have gone for want of memory."""
        return self._dropped

    def _prepare(self, qp: QPBuffers) -> None:
        self.inner._prepare(qp)
        self._sizes = (qp.n, qp.m, qp.p)
        most = self._limit or max(1, MEMORY // (qp.flat.nbytes + qp.solution.nbytes))
        self._kept = deque(maxlen=most)
        self._dropped, self._solves, self._again = 0, 0, False

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        self.inner.iterations = 0
        self.inner._spent = self._spent
        try:
            claim = self.inner._run(qp, cold)
        except Exception:  # a failure of the solver, which the caller counts as one; Ctrl-C is none
            self._keep(qp, Claim.FAILED, cold)
            raise
        self._keep(qp, claim, cold)
        return claim

    def _keep(self, qp: QPBuffers, claim: Claim, cold: bool) -> None:
        self.iterations = self.inner.iterations
        answered = claim <= Claim.MAX_ITERATIONS and bool(np.isfinite(qp.solution).all())
        claim = claim if answered or claim > Claim.MAX_ITERATIONS else Claim.FAILED
        # A warm start that fails is repeated cold at once: the same QP, whose last answer counts.
        again, self._again = self._again, not cold and claim is not Claim.SOLVED
        self._solves += not again
        tick = self._solves - 1 if self._leader is None else self._leader.tick
        if tick < self._first or (self._last is not None and tick > self._last):
            return
        if (tick - self._first) % self._every:
            return
        kept = _Kept(
            tick=tick,
            flat=qp.flat.copy(),
            solution=qp.solution.copy() if answered else np.full(len(qp.solution), np.nan),
            claim=claim,
            iterations=self.iterations,
            cold=cold and not again,
        )
        if self._kept and tick == self._kept[-1].tick:
            self._kept[-1] = kept
            return
        if self._kept and tick < self._kept[-1].tick:
            self._kept.clear()
            self._dropped = 0
        self._dropped += len(self._kept) == self._kept.maxlen
        self._kept.append(kept)

    def recording(
        self,
        *,
        dt: float,
        variables: Sequence[str] | None = None,
        rows: Sequence[str] | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> Recording:
        """What was kept, as a recording.

        Args:
            dt: Time between ticks, > 0 [s].
            variables: Names of x, (n,); None is x0, x1, ...
            rows: Names of [A; C], (m + p,); None is row0, row1, ...
            metadata: What JSON can hold; the backend's name is added.

        Raises:
            InputError: Nothing was kept, or the names do not fit.
        """
        if not self._kept:
            raise InputError("no QP was recorded; let the planner step, or widen first and last")
        n, m, p = self._sizes
        problems = QPBuffers.zeros(n, m, p)
        stacks: dict[str, list[FloatArray]] = {name: [] for name in (*PARTS, *ANSWER)}
        for kept in self._kept:
            problems.flat[:], problems.solution[:] = kept.flat, kept.solution
            for name, stack in stacks.items():
                stack.append(getattr(problems, name).copy())
        tick = np.array([kept.tick for kept in self._kept])
        arrays: dict[str, Any] = {name: np.stack(stack) for name, stack in stacks.items()}
        return Recording(
            **arrays,
            claim=np.array([int(kept.claim) for kept in self._kept]),
            iterations=np.array([kept.iterations for kept in self._kept]),
            cold=np.array([kept.cold for kept in self._kept]),
            tick=tick,
            time=tick * positive("dt", dt, "s"),
            variables=tuple(variables) if variables is not None else tuple(f"x{i}" for i in range(n)),
            rows=tuple(rows) if rows is not None else tuple(f"row{i}" for i in range(m + p)),
            metadata={**(metadata or {}), "backend": self.inner.name},
        )
