"""Rollouts of many arms: what ``planner.step`` does in closed loop, compiled, on all cores."""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from operator import index
from typing import Any, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.rollout_setup import RolloutSetup
from ftqp.control.planner.status import StepStatus
from ftqp.control.planner.target import Targets
from ftqp.core.checks import FULL_TURN, FloatArray, IntArray, instance, whole_number
from ftqp.core.errors import InputError
from ftqp.faults.belief import fault_record, weakens
from ftqp.faults.kinds import KINDS, Fault
from ftqp.kernel.entry.rollouts import Batch, drive
from ftqp.kernel.entry.session import thread_count
from ftqp.model.robot import Robot

EXPECTED = "None, a fault, (fault, tick), or a list of those"


@final
class OwnFaults:
    """Faults by arm, in the form that compiled code takes.

    Attributes:
        events: Tick, index of the fault, and 1 where it may leave a joint too weak, (E, 3), by arm, then by
            tick.
        starts: Where the events of each arm begin, (B + 1,).
        faults: Records of all faults.
    """

    def __init__(self, faults: Any, arms: int, what_ifs: RolloutSetup) -> None:
        self._robot, self._belief = what_ifs.robot, what_ifs.belief
        self._numbers: dict[tuple[int, Fault], int] = {}
        events: list[tuple[int, int, int]] = []
        starts = [0]
        known: dict[int, list[tuple[int, int, int]]] = {}
        for arm, entry in enumerate(_entries(faults, arms)):
            own = known.get(id(entry))  # many arms may be given the very same entry, which lives on
            if own is None:
                own = known[id(entry)] = self._events_of(_reports(entry, arm))
            events += own
            starts.append(len(events))
        self.events: IntArray = np.array(events or [(0, 0, 0)], dtype=np.int64)
        self.starts: IntArray = np.array(starts, dtype=np.int64)
        records = [fault_record(*one) for one in self._numbers] or [fault_record(0, None)]
        self.faults = np.concatenate(records)

    def _events_of(self, reported: list[tuple[Fault, int]]) -> list[tuple[int, int, int]]:
        """The events of one arm by tick; what it believes already is none."""
        events, belief, robot = [], self._belief, self._robot
        for fault, tick in sorted(reported, key=lambda pair: pair[1]):
            before, belief = belief, belief.reported(fault)
            i = int(robot.chain.lead[robot.joint(fault.joint)])
            meant = belief.faults[robot.joints[i]]
            if belief is not before:
                number = self._numbers.setdefault((i, meant), len(self._numbers))
                events.append((tick, number, int(weakens(robot, meant))))
        return events


def _entries(faults: Any, arms: int) -> Sequence[Any]:
    if faults is None:
        return [None] * arms
    if isinstance(faults, tuple(KINDS.values())) or not isinstance(faults, Sequence):
        raise InputError(f"faults is {faults!r:.60}, expected a list with one entry an arm: {EXPECTED}")
    if len(faults) != arms:
        raise InputError(f"faults has {len(faults)} entries, expected one for each of {arms} arms")
    return faults


def _reports(entry: Any, arm: int) -> list[tuple[Fault, int]]:
    """The faults of one arm with their ticks."""
    kinds = tuple(KINDS.values())
    if entry is None:
        return []
    if isinstance(entry, kinds):
        return [(entry, 0)]
    if isinstance(entry, tuple) and len(entry) == 2 and isinstance(entry[0], kinds):
        try:
            tick = index(entry[1])
        except TypeError:
            tick = -1
        if tick < 0:
            raise InputError(
                f"the fault of arm {arm} is at tick {entry[1]!r:.40}, expected a whole number from 0"
            )
        return [(entry[0], tick)]
    if isinstance(entry, list):
        return [pair for one in entry for pair in _reports(one, arm)]
    raise InputError(f"faults[{arm}] is {entry!r:.60}, expected {EXPECTED}")


_LOG = logging.getLogger("ftqp")
WORTH_SAYING = 500e6
"""A batch that takes more memory than this says so [bytes]. A convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rollout:
    """What became of B arms in T ticks.

    Attributes:
        q: Final positions, (B, nv) [rad or m]; NaN for an arm whose start was not finite.
        v: Final velocities, (B, nv).
        position_error: Largest position error on the way, (B,) [m].
        rotation_error: Largest rotation error on the way, (B,) [rad].
        clearance: Least distance of two bodies that are kept apart, (B,) [m]; inf where none are.
        counts: Ticks that ended in each status, (B, number of statuses), in the order of ``ftqp.StepStatus``.
        first_bad: The first tick that did not end in ``OK``, (B,); -1 for an arm all of whose ticks did.
        trace: q after every ``every`` ticks, (B, T // every, nv); of length 0 where none was asked for.
    """

    q: FloatArray
    v: FloatArray
    position_error: FloatArray
    rotation_error: FloatArray
    clearance: FloatArray
    counts: IntArray
    first_bad: IntArray
    trace: FloatArray

    def __repr__(self) -> str:
        ticks = self.counts.sum(axis=0)
        said = ", ".join(f"{n} {status.name}" for n, status in zip(ticks, StepStatus, strict=True) if n)
        return f"Rollout({len(self.q)} arms; ticks: {said or 'none'})"

    def share(self, status: StepStatus) -> FloatArray:
        """The share of its ticks that each arm ended in a status, (B,).

        Args:
            status: Which, for example ``ftqp.StepStatus.OK``.
        """
        instance("status", status, StepStatus, "an ftqp.StepStatus, for example ftqp.StepStatus.OK")
        total = np.maximum(self.counts.sum(axis=1), 1)
        result: FloatArray = self.counts[:, list(StepStatus).index(status)] / total
        return result


def memory(planner: Planner, arms: int, ticks: int = 0, every: int | None = None) -> int:
    """What a rollout takes beside its faults [bytes]; nothing is allocated.

    Args:
        planner: As for ``rollout``.
        arms: How many.
        ticks: How many.
        every: As for ``rollout``.
    """
    n = planner.robot.nv
    kept = ticks // every if every else 0
    return arms * 8 * (4 * n + 6 + len(StepStatus) + kept * n)


def rollout(
    planner: Planner,
    q: Any,
    v: Any = None,
    targets: Targets | None = None,
    *,
    faults: Any = None,
    every: int | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Rollout:
    """Drive many arms like this one through a trajectory, each from its start and with faults of its own.

    Each arm follows its commands exactly, as on ``ftqp.KinematicPlant``: its command is its next state. The
    commands are those of ``planner.step`` to rounding, from a ``reset`` at the start on; every arm has the
    task, scheme, bounds, posture and believed faults of the planner, which does not change. A planner that
    was made without a posture has each arm return to its own start.

    Ctrl-C stops all threads within a moment and raises ``KeyboardInterrupt``; nothing is returned then.

    Args:
        planner: An ``ftqp.Planner`` with the backend ``active_set``.
        q: Starts, (B, nv) [rad or m], or one for all arms, (nv,). An arm whose start is not finite is left
            where it is, all its ticks count as INVALID_INPUT, and the other arms are driven all the same.
        v: Start velocities, (B, nv) or (nv,); None is rest.
        targets: Where the end effector should be at each tick, the same for every arm.
        faults: What is reported to each arm, one entry an arm: ``None``, a fault (at tick 0), ``(fault,
            tick)``, or a list of those. A tick after the end is never reached; the log says so. None spares
            every arm. With one start for all arms there are as many arms as entries.
        every: After how many ticks q is kept in ``trace``; None keeps none.
        threads: How many threads of the CPU share the arms out, >= 1; None is all cores. The result is the
            same with any number.
        progress: Called in this thread with the number of arms that are done and of all, now and then.

    Returns:
        What became of the arms, in their order.

    Raises:
        InputError: A wrong shape, entry or number, a planner of another backend, or not memory
            enough.

    Example:
        >>> import numpy as np, ftqp
        >>> robot = ftqp.robots.load("panda")
        >>> planner = ftqp.Planner(robot, level="velocity")
        >>> path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.05, duration=1.0)
        >>> samples = path.sample(np.arange(1000) * planner.dt)
        >>> targets = ftqp.Targets(samples.pose, samples.twist)
        >>> faults = [(ftqp.Locked(joint), 200) for joint in robot.joints]
        >>> done = ftqp.batch.rollout(planner, robot.neutral, targets=targets, faults=faults)
        >>> survived = done.position_error < 1e-3
    """
    if not isinstance(planner, Planner):
        raise InputError(f"planner is of type {type(planner).__name__}, expected an ftqp.Planner")
    if not isinstance(targets, Targets):
        raise InputError(f"targets is of type {type(targets).__name__}, expected ftqp.Targets(poses, twists)")
    what_ifs = planner.what_ifs()
    starts, speeds = _starts(planner, q, v, faults)
    _warn_of_degrees(planner.robot, starts)
    arms, ticks = len(starts), len(targets)
    step = whole("every", every) if every is not None else 0
    look_at_memory(memory(planner, arms, ticks, step), arms)
    own = OwnFaults(faults, arms, what_ifs)
    if late := int(np.sum(own.events[: own.starts[-1], 0] >= ticks)):
        _LOG.warning(
            "%d of %d faults are reported at tick %d or later, which is never reached",
            late,
            own.starts[-1],
            ticks,
        )
    workers = thread_count() if threads is None else whole("threads", threads)
    batch = Batch.begun(
        starts, speeds, targets.packed, step, faults=own.faults, events=own.events, starts=own.starts
    )
    say = None if progress is None else lambda count: progress(count, arms)
    setup = what_ifs.session, what_ifs.commands, what_ifs.samples
    drive(*setup, batch, threads=workers, progress=say)
    finite = np.isfinite(starts).all(axis=1) & np.isfinite(speeds).all(axis=1)
    batch.q[~finite] = batch.v[~finite] = np.nan
    return Rollout(**{field.name: getattr(batch, field.name) for field in fields(Rollout)})


def _starts(planner: Planner, q: Any, v: Any, faults: Any) -> tuple[FloatArray, FloatArray]:
    """q and v of every arm, (B, nv), finite or not."""
    n = planner.robot.nv
    q = _numbers("q", q)
    given = q.shape
    if q.ndim == 1:
        q = np.broadcast_to(q, (len(faults) if isinstance(faults, list | tuple) else 1, len(q)))
    if q.ndim != 2 or q.shape[1] != n:
        raise InputError(f"q has shape {given}, expected (B, nv) = (B, {n}), or (nv,) for all arms alike")
    v = np.zeros(n) if v is None else _numbers("v", v)
    if v.shape not in ((n,), q.shape):
        raise InputError(f"v has shape {v.shape}, expected {q.shape} as q, or ({n},) for all arms alike")
    return np.ascontiguousarray(q), np.ascontiguousarray(np.broadcast_to(v, q.shape))


def _warn_of_degrees(robot: Robot, starts: FloatArray) -> None:
    """One warning where an arm starts farther beyond its range than anybody means."""
    away = np.maximum(robot.limits.q_min - starts, starts - robot.limits.q_max)
    found = np.argwhere(away > FULL_TURN)
    if len(found):
        arm, joint = found[0]
        _LOG.warning(
            "%s: arm %d starts with %s at %.4g, beyond its range %.4g to %.4g; are these degrees?",
            robot.name, arm, robot.joints[joint], starts[arm, joint], robot.limits.q_min[joint],
            robot.limits.q_max[joint],
        )  # fmt: skip


def _numbers(name: str, value: Any) -> FloatArray:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{name} is no array of numbers ({error}), expected (B, nv), every arm of the same size"
        ) from error


def whole(name: str, value: Any) -> int:
    whole_number(name, value, 1)
    return int(value)


def look_at_memory(needed: int, arms: int) -> None:
    """Say how much memory a large batch takes before it is taken; refuse more than there is."""
    there = _memory_there()
    if there is not None and needed > there:
        raise InputError(
            f"{arms} arms take {needed / 1e9:.3g} GB, this machine has {there / 1e9:.3g} GB; roll out fewer "
            "arms at a time, or keep q after more ticks"
        )
    if needed > WORTH_SAYING:
        _LOG.warning("a batch of %d arms takes %.2g GB", arms, needed / 1e9)


def _memory_there() -> int | None:
    """Memory of this machine [bytes]; None where the system does not say."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
