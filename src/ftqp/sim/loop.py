"""The simulation loop: truth, target, planner, log and plant in the order in which they happen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any, final

import numpy as np

from ftqp.control.following.path_follower import PathFollower, PathStatus
from ftqp.control.paths import Path, mean_acceleration
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import StepStatus
from ftqp.control.planner.target import Target
from ftqp.core import clock
from ftqp.core.checks import FloatArray, positive
from ftqp.core.errors import InputError, unknown
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.log.description import description
from ftqp.sim.log.log_file import LogWriter
from ftqp.sim.log.metrics import STOP_CODES
from ftqp.sim.log.row_writer import RowWriter
from ftqp.sim.log.signals import base_columns, columns
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant
from ftqp.sim.schedule import Schedule

FEED_FORWARDS = ("sampled", "mean")
BLOCK = 2048
"""Ticks whose targets are sampled together."""
PROGRESS_PERIOD = 100_000_000
"""Progress is told at most this often [ns of wall time]."""
LONGEST = 3.0
"""A path that is followed by its progress may take so many times its duration."""
WAITS = 0.5
"""How long the arm is watched after its path was blocked [s]."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """How a simulation ended.

    Attributes:
        steps: ticks done, the one at time 0 included.
        completed: all ticks done and the task never given up.
        interrupted: whether Ctrl-C ended it; log and result are complete up to then.
        final_status: status of the last step.
        stopped_at: time of the first step that gave up the task [s], or ``None``.
        status_counts: how many steps had each status, those that occurred.
        q: where the arm ended, (nv,) [rad or m].
        v: its velocity there, (nv,) [rad/s or m/s].
        progress: path time reached [s].
        blocked: why the path did not go on, or ``None``.
    """

    steps: int
    completed: bool
    interrupted: bool
    final_status: StepStatus | None
    stopped_at: float | None
    status_counts: Mapping[StepStatus, int]
    q: FloatArray
    v: FloatArray
    progress: float
    blocked: str | None


@final
class Simulation:
    """A planner leads an arm along a path while joints fail.

    At every tick k = 0 ... N, in this order: faults happen and are announced, target at t_k = k dt, planner's
    step, row of the log, plant moves on.

    Args:
        planner: the planner; it is reset to the start, and what it believes failed before stays believed.
        path: what the tip is to follow.
        q: start of the arm, (nv,) or (nq,) [rad or m].
        v: its start velocity, (nv,) [rad/s or m/s]; at rest without it.
        schedule: what fails when; nothing without it.
        plant: the arm; without it a `KinematicPlant` of the planner's robot.
        follower: leads the planner along the path by its progress, in place of the clock; the run then ends
            with the path, or soon after it was blocked.
        duration: simulated time, the longest with a follower [s]; without it the path's duration, twice that
            with a follower.
        feed_forward: ``"sampled"`` feeds forward the path's acceleration at t_k, ``"mean"`` its mean over dt.
        log: a new file for the log, or ``None`` for none.
        metadata: more to put into the log, for example the resolved scenario.
        world: the base under the arm where it moves, with the inertial task of this planner; the path is then
            one in the inertial frame. Without it the base stands.
        progress: called with (ticks done, ticks in all) about ten times a second.

    Raises:
        InputError: an unknown joint in the schedule, a wrong value, or a log file that exists.

    Source: order of a tick of the different-level scheme, spec section 10.
    """

    def __init__(
        self,
        planner: Planner,
        path: Path,
        *,
        q: Any,
        v: Any = None,
        schedule: Schedule | None = None,
        plant: Plant | None = None,
        follower: PathFollower | None = None,
        duration: float | None = None,
        feed_forward: str = "sampled",
        log: str | File | None = None,
        metadata: Mapping[str, Any] | None = None,
        progress: Callable[[int, int], None] | None = None,
        world: MovingWorld | None = None,
    ) -> None:
        robot = planner.robot
        if feed_forward not in FEED_FORWARDS:
            raise unknown("feed-forward", feed_forward, "a simulation", FEED_FORWARDS)
        self._planner, self._path = planner, path
        self._schedule = Schedule() if schedule is None else schedule
        for event in self._schedule:
            robot.joint(event.fault.joint)
        self._plant = KinematicPlant(robot, planner.dt, planner.level) if plant is None else plant
        if follower is not None and (follower.planner is not planner or follower.path is not path):
            raise InputError("follower leads another planner or another path than the simulation's")
        self._follower = follower
        natural = path.duration * (1.0 if follower is None else LONGEST)
        time = natural if duration is None else positive("duration of the simulation", duration, "s")
        self._last = round(time / planner.dt)
        if self._last < 1:
            raise InputError(
                f"duration of the simulation is {time:g} s, expected at least one step of {planner.dt:g} s"
            )
        self._mean = feed_forward == "mean"
        self._q = robot.angles(q)
        self._v = np.zeros(robot.nv) if v is None else np.array(v, dtype=np.float64)
        self._believed = dict(planner.faults)
        self._log = log
        self._metadata = dict(metadata or {})
        self._progress = progress
        self._world = world
        if world is not None and world.follower.planner is not planner:
            raise InputError(
                "the world's inertial task has another planner than the simulation; give it this one"
            )
        if world is not None and follower is not None:
            raise InputError("a path's progress does not wait for a moving base; leave follower or world out")

    def run(self) -> Result:
        """Simulate to the end, or until Ctrl-C, which leaves complete files and a result that says so.

        Raises:
            FtqpError: the log cannot be written.
        """
        planner = self._planner
        self._forget_faults()
        (planner if self._follower is None else self._follower).reset(self._q, self._v)
        self._plant.reset(self._q, self._v)
        world = self._world
        if world is not None:
            world.reset(self._q, self._v, self._last + 1)
        if self._log is None:
            return self._ticks(None)
        signals = columns(planner.robot.joints, planner.robot.chain.prismatic, planner.level)
        if world is not None:
            signals += base_columns(world.base.coordinates)
        reference = "time" if self._follower is None else "progress"
        about = description(planner, self._schedule, self._path, self._last, reference) | self._metadata
        with LogWriter(self._log, signals, about | {"state": "running"}) as log:
            result = self._ticks(RowWriter(log, planner, follower=self._follower, world=world))
            finished = self._follower is None or self._follower.status is PathStatus.DONE
            log.annotate(
                {
                    "state": "interrupted" if result.interrupted else "finished",
                    "path_finished": finished,
                    "blocked": result.blocked,
                }
            )
        return result

    def _forget_faults(self) -> None:
        """Let the planner believe what it believed before the first run."""
        for joint in tuple(self._planner.faults):
            if joint not in self._believed:
                self._planner.withdraw(joint)
        for fault in self._believed.values():
            self._planner.report(fault)

    def _ticks(self, rows: RowWriter | None) -> Result:
        """All ticks."""
        planner, plant, dt = self._planner, self._plant, self._planner.dt
        follower, world = self._follower, self._world
        lead = planner if world is None else world
        failing, announced = self._schedule.failing(dt), self._schedule.announced(dt)
        target = Target(pose=self._path.start) if follower is None else follower.target
        waited, over = 0.0, False
        counts = [0] * len(StepStatus)
        done, stopped_at, code = 0, None, None
        told = clock.now()
        interrupted = False
        try:
            for k in range(self._last + 1):
                at = k % BLOCK
                if at == 0 and follower is None:
                    pose, twist, acceleration = self._targets(k)
                for event in failing.get(k, ()):
                    plant.fail(event.fault)
                    if rows is not None:
                        rows.fail(event.fault)
                for event in announced.get(k, ()):
                    planner.report(event.fault)
                if follower is None:
                    target.pose[:] = pose[at]
                    target.twist[:] = twist[at]
                    target.acceleration[:] = acceleration[at]
                    reached = min(k * dt, self._path.duration)
                    if world is not None:
                        world.sense(k, plant.q, pose[at])
                    before = clock.now()
                    step = lead.step(plant.q, plant.v, target)
                    elapsed = clock.now() - before
                else:
                    reached = follower.progress
                    before = clock.now()
                    step = follower.step(plant.q, plant.v)
                    elapsed = clock.now() - before
                    waited += dt if follower.status is PathStatus.BLOCKED else 0.0
                    over = reached >= self._path.duration or waited > WAITS
                if rows is not None:
                    rows.write(
                        k * dt,
                        plant.q,
                        plant.v,
                        target.pose,
                        step,
                        elapsed,
                        twist=target.twist,
                        progress=reached,
                    )
                code = step.code
                counts[code] += 1
                if stopped_at is None and code in STOP_CODES:
                    stopped_at = k * dt
                plant.advance(step)
                done = k + 1
                if self._progress is not None and before - told > PROGRESS_PERIOD:
                    told = before
                    self._progress(done, self._last + 1)
                if over:
                    break
        except KeyboardInterrupt:
            interrupted = True
        if self._progress is not None:
            self._progress(done, self._last + 1)
        statuses = list(StepStatus)
        return Result(
            steps=done,
            completed=stopped_at is None
            and not interrupted
            and (done == self._last + 1 if follower is None else follower.status is PathStatus.DONE),
            interrupted=interrupted,
            final_status=None if code is None else statuses[code],
            stopped_at=stopped_at,
            status_counts={status: count for status, count in zip(statuses, counts, strict=True) if count},
            q=plant.q.copy(),
            v=plant.v.copy(),
            progress=min(max(done - 1, 0) * dt, self._path.duration)
            if follower is None
            else follower.progress,
            blocked=None if follower is None else follower.blocked,
        )

    def _targets(self, first: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Poses, twists and accelerations of the next ticks."""
        dt = self._planner.dt
        t = np.arange(first, min(first + BLOCK, self._last + 1)) * dt
        sample = self._path.sample(t)
        acceleration = mean_acceleration(self._path, t, dt) if self._mean else sample.acceleration
        return sample.pose, sample.twist, acceleration
