"""How far working joints were beyond their limits, and how far failed ones moved, block of rows by block."""

from collections.abc import Mapping
from typing import Any, Final, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.faults.kinds import KINDS, kind_of
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.sim.log.signal_blocks import Signals
from ftqp.sim.log.signals import refuse_unknown_conditions

BRAKED = 1e-3
"""Speed below which a joint that a real brake holds counts as at rest [rad/s or m/s]: brakes creep."""
LIMITED: Final = (
    ("q", "q_min", "q_max"),
    ("v", None, "v_max"),
    ("a", None, "a_max"),
    ("tau", None, "tau_max"),
)
"""Signals with the names of their lower and upper limits; for None the lower is minus the upper one."""
IDLE: Final = [kind.number for kind in KINDS.values() if not kind.works]
"""What ``truth`` says of joints that do not work."""


@final
class Excess:
    """The largest excess of a working joint over its limits of q, v, a and motor torque.

    A limit counts at its healthy value, from the announcement of a degradation on at what is left of it, and
    there not before the joint has been inside once.

    Attributes:
        worst: By signal; 0 where every limit was kept.
    """

    def __init__(self, metadata: Mapping[str, Any]) -> None:
        self._limits = metadata["limits"]
        self._weak = [
            (number, fault)
            for number, fault in enumerate(metadata.get("faults", []))
            if fault["announced"] is not None
        ]
        self._inside: dict[tuple[int, str], bool] = {}
        self._first: float | None = None
        self.worst = {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0}

    def add(self, rows: Signals) -> None:
        """Look at the rows that come next."""
        t = rows["t"]
        if not len(t):
            return
        first = float(t[0]) if self._first is None else self._first
        refuse_unknown_conditions(rows["truth"], "the log")
        works, worst, inside = ~np.isin(rows["truth"], IDLE), dict(self.worst), dict(self._inside)
        for signal, low, high in LIMITED:
            values = rows[signal]
            top = self._limit(t, values.shape, high, np.inf, first)
            bottom = -top if low is None else self._limit(t, values.shape, low, -np.inf, first)
            with np.errstate(invalid="ignore", over="ignore"):  # inf - inf is no excess
                excess = np.maximum(values - top, bottom - values)
            counts = works.copy()
            if signal in ("q", "v"):
                for number, fault in self._weak:
                    if kind_of(fault["kind"]).works:
                        i, since = fault["index"], t >= fault["announced"] - TIME_SLACK
                        been = np.logical_or.accumulate(since & (excess[:, i] <= 0.0))
                        been |= inside.get((number, signal), False)
                        counts[:, i] &= ~since | been
                        inside[number, signal] = bool(been[-1])
            found = excess[counts & np.isfinite(excess)]
            worst[signal] = max(worst[signal], float(found.max()) if len(found) else 0.0)
        self._first, self._inside, self.worst = first, inside, worst

    def _limit(
        self, t: FloatArray, shape: tuple[int, ...], name: str, infinite: float, first: float
    ) -> FloatArray:
        """A limit of all joints over time, (K, nv), lowered from the announcement of a degradation on."""
        healthy = np.array([infinite if value is None else value for value in self._limits[name]])
        values: FloatArray = np.broadcast_to(healthy, shape)
        for _, fault in self._weak:
            i, shares = fault["index"], kind_of(fault["kind"]).shares
            since = t >= fault["announced"] - TIME_SLACK
            from_start = first >= fault["announced"] - TIME_SLACK
            narrower = fault.get(name) if name in ("q_min", "q_max") else None
            if narrower is None and name not in shares:
                continue
            values = values.copy()
            if narrower is not None:
                left = max(narrower, healthy[i]) if name == "q_min" else min(narrower, healthy[i])
                values[since, i] = left
                healthy[i] = left if from_start else healthy[i]
            else:
                values[since, i] *= fault[shares[name]]
        return values


@final
class Motion:
    """How far each locked joint has moved since it came to rest, each free one since it failed [rad or m]."""

    def __init__(self, metadata: Mapping[str, Any]) -> None:
        self._faults = [
            (number, fault)
            for number, fault in enumerate(metadata.get("faults", []))
            if not kind_of(fault["kind"]).works
        ]
        self._rest = BRAKED if metadata.get("plant_tolerance") else 0.0
        self._at_rest: dict[int, bool] = {}
        self._from: dict[int, float] = {}
        self._moved: dict[int, float] = {}

    def add(self, rows: Signals) -> None:
        """Look at the rows that come next."""
        t = rows["t"]
        if not len(t):
            return
        at_rest, begun, moved = dict(self._at_rest), dict(self._from), dict(self._moved)
        for number, fault in self._faults:
            i = fault["index"]
            failed = rows["truth"][:, i] == kind_of(fault["kind"]).number
            failed = failed & (t >= fault["at"] - TIME_SLACK)
            if fault["kind"] == "locked":
                rested = np.logical_or.accumulate(failed & (np.abs(rows["v"][:, i]) <= self._rest))
                rested |= at_rest.get(number, False)
                at_rest[number] = bool(rested[-1])
                failed &= rested
            q = rows["q"][failed, i]
            if len(q):
                begun.setdefault(number, float(q[0]))
                moved[number] = max(moved.get(number, 0.0), float(np.abs(q - begun[number]).max()))
        self._at_rest, self._from, self._moved = at_rest, begun, moved

    @property
    def by_joint(self) -> dict[str, float]:
        """By the name of the joint, those that have failed."""
        return {
            fault["joint"]: self._moved[number] for number, fault in self._faults if number in self._moved
        }


@final
class Following:
    """What was sent for a tick minus where the joint truly was then [rad or m].

    It is 0 at the first tick, before anything was sent, and NaN for a joint that does not work.
    """

    def __init__(self) -> None:
        self._sent: FloatArray | None = None
        self._worst: FloatArray | None = None

    def add(self, rows: Signals) -> FloatArray:
        """The errors of the rows that come next, (K, nv)."""
        q, sent = rows["q"], rows["q_command"]
        error = np.zeros(q.shape)
        error[1:] = sent[:-1] - q[1:]
        if self._sent is not None and len(q):
            error[0] = self._sent - q[0]
        idle: BoolArray = np.isin(rows["truth"], IDLE)
        result: FloatArray = np.where(idle, np.nan, error)
        if len(q):
            size = np.where(np.isfinite(result), np.abs(result), -np.inf).max(axis=0)
            self._worst = size if self._worst is None else np.maximum(self._worst, size)
            self._sent = sent[-1].copy()
        return result

    def largest(self, i: int) -> float | None:
        """The largest error of joint i; None where there is none."""
        worst = -np.inf if self._worst is None else float(self._worst[i])
        return worst if np.isfinite(worst) else None
