"""Arms that live between calls: a target, faults and resets of its own for each, on all cores."""

from typing import Any, final

import numpy as np

from ftqp.control.batch.many_arms import look_at_memory, whole
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import BoolArray, FloatArray, IntArray, seen
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief, fault_record, weakens
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.kernel.entry.arm_records import ArmRecords
from ftqp.kernel.entry.session import thread_count
from ftqp.kernel.layout.enums import TARGET_ACCELERATION, TARGET_HAS_ROTATION, TARGET_POSE, TARGET_TWIST
from ftqp.kernel.layout.record import dtype

NO_FREE = "FreeSwinging cannot be reported to Arms; report ftqp.Locked, or step an ftqp.Planner"

AT_ORIGIN = np.eye(4)


@final
class Arms:
    """Arms like that of a planner, each with a memory of its own between calls, as learning needs them.

    Each arm does bit by bit what a planner made alike and stepped alone would: its memory is as large, 2.2 MB
    an arm. It begins at rest at the robot's neutral posture, with the faults that the planner believes in.
    The planner stays as it is.

    Args:
        planner: An ``ftqp.Planner`` with the backend ``active_set`` and no plan.
        n: How many arms, >= 1.
        threads: How many threads of the CPU share a step out, >= 1; None is all cores. The result is the
            same with any number.

    Attributes:
        q: Where each arm is, (n, nv) [rad or m]: after a step where its command leads. A step begins there.
            Of an arm that strays from its command, write what was measured into ``q`` before the step.
        v: Its velocity, (n, nv).
        q_sent: What the drives are sent after the last tick, (n, nv); it differs from ``q`` where a joint has
            failed or drives are led.
        v_sent: The same of velocities, (n, nv).
        found: What each arm has found of its joints and counts on, (n, nv): 0 nothing, 1 that it is locked, 2
            that it swings freely.
        status: How the last tick of each arm ended, (n,): places in ``list(ftqp.StepStatus)``.
        position_error: Position error at the begin of the last tick, (n,) [m].
        rotation_error: Rotation error, (n,) [rad].

    Raises:
        InputError: No such planner, one that believes in a free joint, or more memory than there is.

    Example:
        >>> import numpy as np, ftqp
        >>> robot = ftqp.robots.load("panda")
        >>> planner = ftqp.Planner(robot, 0.004, task=ftqp.Task("position"))
        >>> arms = ftqp.batch.Arms(planner, 8)
        >>> arms.report(np.arange(8) == 3, ftqp.Locked(1))
        >>> goals = robot.pose(robot.neutral)[:3, 3] + np.random.default_rng(1).uniform(-0.1, 0.1, (8, 3))
        >>> for _ in range(200):
        ...     arms.step(goals, ticks=5)
    """

    def __init__(self, planner: Planner, n: int, *, threads: int | None = None) -> None:
        if not isinstance(planner, Planner):
            raise InputError(f"planner is of type {type(planner).__name__}, expected an ftqp.Planner")
        count = whole("n", n)
        workers = thread_count() if threads is None else whole("threads", threads)
        like = planner.what_ifs()
        self._robot, self._count = like.robot, count
        look_at_memory(count * (dtype("record").itemsize + dtype("given").itemsize), count)
        self._belief = like.belief
        for fault in like.belief.faults.values():
            _served(fault)
        like.session.K.monitor.names = int(like.finds)  # each arm responds for itself
        self._turns = bool(like.session.K.task.uses_rotation)
        self._faults: list[Fault | None] = [None]
        nv = self._robot.nv
        before = [self._number(self._belief.faults.get(joint)) for joint in self._robot.joints]
        self._before = np.array(before)
        self._reports: IntArray = np.tile(self._before, (count, 1))
        self._records = ArmRecords(like.session, like.commands, like.samples, count, nv, workers)
        self.q, self.v = self._records.q, self._records.v
        sent = seen(self._records.sent)
        self.q_sent, self.v_sent = sent[:, 0], sent[:, 1]
        self.found: IntArray = seen(self._records.found)
        self.status: IntArray = seen(self._records.status)
        error = seen(self._records.error)
        self.position_error, self.rotation_error = error[:, 0], error[:, 1]
        target = self._records.targets
        self._pose = target[:, TARGET_POSE:TARGET_TWIST].reshape(count, 4, 4)
        self._twist = target[:, TARGET_TWIST:TARGET_ACCELERATION]
        self._has_rotation = target[:, TARGET_HAS_ROTATION]
        self._all: BoolArray = np.ones(count, dtype=bool)
        self.reset()

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        failed = int(((self._reports > 0) | (self.found > 0)).any(axis=1).sum())
        return f"Arms({self._count} of {self._robot.name}, {failed} with a fault)"

    def reset(self, mask: Any = None, q: Any = None, v: Any = None) -> None:
        """Begin anew, as arms just made do: nothing that the last episode reported or estimated is left.

        Args:
            mask: Which arms, (n,) truth values; None is all.
            q: Where they begin, (n, nv), rows of other arms are not looked at; or (nv,) for all alike
                [rad or m]; None is the robot's neutral posture.
            v: As q, their velocities; None is rest.

        Raises:
            InputError: A wrong shape, or a number that is not finite.
        """
        mask = self._mask(mask)
        starts = self._starts("q", self._robot.neutral if q is None else q, mask)
        speeds = self._starts("v", np.zeros(self._robot.nv) if v is None else v, mask)
        np.copyto(self.q, starts, where=mask[:, None])
        np.copyto(self.v, speeds, where=mask[:, None])
        np.copyto(self._reports, self._before, where=mask[:, None])
        self._records.sent[mask, 0], self._records.sent[mask, 1] = self.q[mask], self.v[mask]
        self._records.status[mask] = 0
        self._records.error[mask] = 0.0
        self._records.begin(mask)

    def report(self, mask: Any, fault: Fault) -> None:
        """Let arms believe a fault from their next step on, as ``planner.report`` does.

        Args:
            mask: Which arms, (n,) truth values; None is all.
            fault: ``ftqp.Locked`` or ``ftqp.Degraded``; it takes the place of another one of the same joint.

        Raises:
            InputError: A wrong mask, an unknown joint, not a fault, or a free joint.
        """
        mask = self._mask(mask)
        belief = Belief(self._robot).reported(_served(fault))
        ((joint, fault),) = belief.faults.items()  # of the joint whose motor it concerns
        self._tell(mask, self._robot.joint(joint), fault)

    def withdraw(self, mask: Any, joint: str | int) -> None:
        """Let arms believe that a joint is healthy from their next step on, as ``planner.withdraw`` does.

        Args:
            mask: Which arms, (n,) truth values; None is all.
            joint: Its name or 0-based index; where it is healthy it stays so.

        Raises:
            InputError: A wrong mask, or an unknown joint.
        """
        self._tell(self._mask(mask), int(self._robot.chain.lead[self._robot.joint(joint)]), None)

    def faults(self, arm: int) -> dict[str, Fault]:
        """The faults that one arm believes in now, by joint name."""
        reported = [self._faults[self._believed(joint)[arm]] for joint in range(self._robot.nv)]
        return {name: one for name, one in zip(self._robot.joints, reported, strict=True) if one is not None}

    def step(self, targets: Any, ticks: int = 1, *, twist: Any = None, mask: Any = None) -> None:
        """Bring every arm ``ticks`` periods on towards its own target; ``q``, ``v`` and the others follow.

        Nothing is allocated where arrays of float64 are given.

        Args:
            targets: Positions, (n, 3) [m], for a task without rotation rows, or poses, (n, 4, 4). They stand
                for all ticks of the step. An arm whose target is not finite ends in INVALID_INPUT.
            ticks: How many periods, >= 1.
            twist: How fast each target moves, (n, 6), linear [m/s], then angular [rad/s]; None is at rest.
            mask: Which arms take part, (n,) truth values; the others stay as they are. None is all.

        Raises:
            InputError: A wrong shape or number, or positions for a task with rotation rows.
        """
        targets, n = np.asarray(targets, dtype=float), self._count
        if targets.shape == (n, 3) and not self._turns:
            self._pose[:] = AT_ORIGIN
            self._pose[:, :3, 3] = targets
            self._has_rotation[:] = 0.0
        elif targets.shape == (n, 4, 4):
            self._pose[:] = targets
            self._has_rotation[:] = 1.0
        else:
            or_three = "" if self._turns else f" or positions, ({n}, 3)"
            raise InputError(
                f"targets has shape {targets.shape}, expected poses, (n, 4, 4) = ({n}, 4, 4){or_three}"
            )
        if twist is None:
            self._twist[:] = 0.0
        else:
            twist = np.asarray(twist, dtype=float)
            if twist.shape != (n, 6):
                raise InputError(f"twist has shape {twist.shape}, expected (n, 6) = ({n}, 6)")
            self._twist[:] = twist
        self._records.mask[:] = self._mask(mask)
        self._records.step(whole("ticks", ticks))

    def poses(self, q: Any = None) -> FloatArray:
        """The pose of every arm's end effector, (n, 4, 4); one array, valid until the next call.

        Args:
            q: At these joint values, (n, nv) [rad or m]; None is where the arms are.
        """
        where = self.q if q is None else np.ascontiguousarray(q, dtype=float)
        if where.shape != self.q.shape:
            raise InputError(f"q has shape {where.shape}, expected (n, nv) = {self.q.shape}")
        self._records.find_poses(where)
        return seen(self._records.poses)

    def _tell(self, mask: BoolArray, joint: int, fault: Fault | None) -> None:
        """Let arms believe a fault of a joint, or that it works, where they do not yet."""
        number, before = self._number(fault), self._believed(joint)
        locked = np.array([isinstance(one, Locked) for one in self._faults])
        weak = weakens(self._robot, fault)
        self._records.tell(fault_record(joint, fault), mask, mask & (before != number), locked[before], weak)
        self._reports[mask, joint] = number

    def _believed(self, joint: int) -> IntArray:
        """Which fault each arm counts on of a joint, reported or found, (n,)."""
        name, found, reported = self._robot.joints[joint], self.found[:, joint], self._reports[:, joint]
        if not found.any():
            return reported
        either = np.where(found == 1, self._number(Locked(name)), self._number(FreeSwinging(name)))
        return np.where(found == 0, reported, either)

    def _number(self, fault: Fault | None) -> int:
        """The place of a fault in the list of those that were reported."""
        if fault not in self._faults:
            self._faults.append(fault)
        return self._faults.index(fault)

    def _mask(self, mask: Any) -> BoolArray:
        if mask is None:
            return self._all
        given = np.asarray(mask)
        if given.shape != (self._count,) or given.dtype != bool:
            raise InputError(
                f"mask is {given.dtype} of shape {given.shape}, expected truth values, (n,) = "
                f"({self._count},)"
            )
        return np.ascontiguousarray(given)

    def _starts(self, name: str, value: Any, mask: BoolArray) -> FloatArray:
        """Starts of all arms, (n, nv), finite where they count."""
        given = np.asarray(value, dtype=float)
        nv = self._robot.nv
        if given.shape not in ((nv,), (self._count, nv)):
            raise InputError(
                f"{name} has shape {given.shape}, expected (n, nv) = ({self._count}, {nv}), or ({nv},) for "
                "all alike"
            )
        starts = np.broadcast_to(given, (self._count, nv))
        if not np.isfinite(starts[mask]).all():
            raise InputError(f"{name} is not finite for some arm, expected where it begins")
        return starts


def _served(fault: Fault) -> Fault:
    """The fault, unless it is of a joint that swings freely."""
    if isinstance(fault, FreeSwinging):
        raise InputError(NO_FREE)
    return fault
