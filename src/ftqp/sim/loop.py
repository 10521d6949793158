"""The simulation loop: truth, target, planner, log and plant in the order in which they happen."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from math import isclose
from pathlib import Path as File
from typing import Any, final

import numpy as np

from ftqp.control.following.goto import GoTo
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.paths import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import StepStatus
from ftqp.core import clock
from ftqp.core.checks import FloatArray, instance, positive
from ftqp.core.errors import FtqpError, InputError, unknown
from ftqp.core.picture import Picture
from ftqp.core.small_picture import html_table
from ftqp.faults.kinds import SWINGS, FreeSwinging
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.leader import LedArm, leader_along
from ftqp.sim.log.description import description
from ftqp.sim.log.log_arrays import Log, MemoryRows
from ftqp.sim.log.log_rows import RowSink
from ftqp.sim.log.log_writer import LogParts, LogWriter, PartedLog
from ftqp.sim.log.metrics import STOP_CODES, TalliedRows
from ftqp.sim.log.tick_recorder import TickRecorder, signals_of
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant
from ftqp.sim.schedule import Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors

FEED_FORWARDS = ("sampled", "mean")
MEMORY = "memory"
"""In place of a file: the log is kept in memory."""
PROGRESS_PERIOD = 100_000_000
"""Progress is reported at most this often [ns of wall time]."""
_INTERFACES = {"position": "positions", "velocity": "velocities", "torque": "torques"}
_STOPS = np.isin(np.arange(len(StepStatus)), STOP_CODES)
"""Whether the status of each code gives up the task."""
LONGEST = 3.0
"""A path that is followed by its progress may take so many times its duration."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
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
        broken: why the simulation of the arm could not go on, or ``None``.
        log: the log, where it was kept in memory.
        summary: what happened in all ticks, ready for ``summary.json``, where the log is on file.
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
    broken: str | None = None
    log: Log | None = None
    summary: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        """What happened, in a few lines."""
        return "\n".join(["Result", *(f"  {name:9} {value}" for name, value in self._facts())])

    def _repr_html_(self) -> str:
        """The same as a table, for notebooks."""
        picture = "" if self.log is None else self.log.error_svg()
        return html_table("Result", (), self._facts(), picture=picture)

    def _facts(self) -> list[tuple[str, str]]:
        """What happened, by a word each."""
        gave_up = "" if self.stopped_at is None else f", the task was given up at {self.stopped_at:g} s"
        done = "completed" if self.completed else "interrupted" if self.interrupted else "not completed"
        counts = ", ".join(f"{count} {status.name}" for status, count in self.status_counts.items())
        status = (
            "none" if self.final_status is None else f"{self.final_status.name}: {self.final_status.value}"
        )
        facts = [
            ("run", f"{done} in {self.steps} steps{gave_up}"),
            ("status", status),
            ("steps", counts),
            ("path", f"{self.progress:g} s of it reached" + (f"; {self.blocked}" if self.blocked else "")),
        ]
        if self.log is not None and len(self.log):
            error = self.log["position_error"]
            facts.append(
                ("error", f"at most {1e3 * error.max():.3g} mm, {1e3 * error[-1]:.3g} mm at the end")
            )
        if self.broken is not None:
            facts.append(("arm", self.broken))
        facts.append(("q", np.array2string(self.q, precision=4, suppress_small=True, separator=", ")))
        kept = (
            "result.log, result.plot()"
            if self.log is not None
            else "on file"
            if self.summary
            else "none kept"
        )
        return [*facts, ("log", kept)]

    def plot(self, figure: str = "path") -> Picture:
        """One of the figures of the run as a picture, which a notebook shows and ``.save(file)`` keeps.

        Args:
            figure: Its name, as ``Log.plot`` has it.

        Raises:
            InputError: No log was kept in memory, or there is no such figure.
            MissingPackage: matplotlib is not installed.
        """
        if self.log is None:
            raise InputError(
                'there is no log to draw; run ftqp.Simulation(..., log="memory"), or load that of a file by '
                "ftqp.load_log"
            )
        return self.log.plot(figure)


@final
class Simulation:
    """A planner moves an arm along a path while joints fail.

    At every tick k = 0 ... N, in this order: faults happen and are announced, target at t_k = k dt, sensors,
    planner's step, row of the log, plant moves on.

    Args:
        planner: the planner; it is reset to the start, and what it believes failed before stays believed.
        path: what the end effector is to follow.
        q: start of the arm, (nv,) or (nq,) [rad or m].
        v: its start velocity, (nv,) [rad/s or m/s]; at rest without it.
        schedule: what fails when; nothing without it.
        plant: the arm; without it a `KinematicPlant` of the planner's robot.
        sensors: what is measured of the arm; without them the planner is given the truth.
        follower: leads the planner along the path by its progress, in place of the clock; the run then ends
            with the path, or soon after it was blocked. A `GoTo` leads it to its own goal instead, until the
            run's time is up.
        duration: simulated time, the longest with a follower [s]; without it the path's duration, three
            times that with a follower.
        feed_forward: ``"sampled"`` feeds forward the path's acceleration at t_k, ``"mean"`` its mean over dt.
        log: a new file, the parts of a long one, ``"memory"`` for a log in the result, or ``None`` for none.
        singularities: whether the log has the measures of singularity, which take time; they are NaN without.
        metadata: more to put into the log, for example the resolved scenario.
        world: the base under the arm where it moves, with the inertial task of this planner; the path is then
            one in the inertial frame. Without it the base stands.
        progress: called with (ticks done, ticks in all) about ten times a second.

    Raises:
        InputError: an unknown joint in the schedule, a wrong value, or a log file that exists.
    """

    __slots__ = (
        "_arm", "_believed", "_last", "_leader", "_log", "_metadata", "_path", "_planner", "_plant",
        "_progress", "_q", "_schedule", "_sensors", "_signals", "_singularities", "_v",
    )  # fmt: skip

    def __init__(
        self,
        planner: Planner,
        path: Path,
        *,
        q: Any,
        v: Any = None,
        schedule: Schedule | None = None,
        plant: Plant | None = None,
        sensors: JointSensors | None = None,
        follower: PathFollower | GoTo | None = None,
        duration: float | None = None,
        feed_forward: str = "sampled",
        log: str | File | LogParts | None = None,
        singularities: bool = True,
        metadata: Mapping[str, Any] | None = None,
        progress: Callable[[int, int], None] | None = None,
        world: MovingWorld | None = None,
    ) -> None:
        instance("path", path, Path, "a path of ftqp.paths, for example ftqp.paths.Circle(pose, 0.1)")
        robot = planner.robot
        if feed_forward not in FEED_FORWARDS:
            raise unknown("feed-forward", feed_forward, "a simulation", FEED_FORWARDS)
        instance(
            "schedule",
            schedule,
            Schedule | None,
            "ftqp.Schedule([ftqp.FaultEvent(1.0, ftqp.Locked(2))]) or None",
        )
        self._planner, self._path = planner, path
        self._schedule = Schedule() if schedule is None else schedule
        for event in self._schedule:
            robot.joint(event.fault.joint)
            if isinstance(event.fault, FreeSwinging) and event.reported_at is not None:
                robot.refuse_tree(SWINGS)
        self._plant = KinematicPlant(robot, planner.dt, planner.level) if plant is None else plant
        instance("plant", self._plant, Plant, "a plant, for example ftqp.MujocoPlant(robot, dt, servo)")
        if self._plant.dt is not None and not isclose(self._plant.dt, planner.dt):
            raise InputError(
                f"the plant takes a command every {self._plant.dt:g} s, but the planner makes one every "
                f"{planner.dt:g} s; give both the same dt"
            )
        if self._plant.drive is not None and self._plant.drive != planner.drive.kind:
            raise InputError(
                f"the plant takes {_INTERFACES[self._plant.drive]}, but the planner was made for an arm that "
                f"takes {_INTERFACES[planner.drive.kind]} and would close another loop; make it with "
                f"drive={self._plant.drive!r}"
            )
        self._sensors = sensors
        if sensors is not None and sensors.feels_torque and (self._plant.motors is None or world is not None):
            raise InputError(
                "the sensors measure torques, but "
                + ("an inertial task takes none" if world is not None else "this plant has no motors")
                + "; leave torque_noise out, or take plant 'mujoco' on a base that stands"
            )
        follows = follower is not None and (isinstance(follower, GoTo) or follower.path is path)
        if follower is not None and (follower.planner is not planner or not follows):
            raise InputError("follower leads another planner or another path than the simulation's")
        if world is not None and world.follower.planner is not planner:
            raise InputError(
                "the world's inertial task has another planner than the simulation; give it this one"
            )
        if world is not None and follower is not None:
            raise InputError("a path's progress does not wait for a moving base; leave follower or world out")
        self._leader = leader_along(planner, path, follower, world, mean=feed_forward == "mean")
        self._arm = LedArm(planner, self._leader, self._plant, sensors)
        natural = path.duration * (LONGEST if isinstance(follower, PathFollower) else 1.0)
        time = natural if duration is None else positive("duration of the simulation", duration, "s")
        self._last = round(time / planner.dt)
        if self._last < 1:
            raise InputError(
                f"duration of the simulation is {time:g} s, expected at least one step of {planner.dt:g} s"
            )
        self._q = robot.angles(q)
        self._v = np.zeros(robot.nv) if v is None else np.array(v, dtype=np.float64)
        self._believed = dict(planner.faults)
        self._log, self._singularities = log, singularities
        self._signals = signals_of(planner, self._leader, self._arm.sensed)
        self._metadata = dict(metadata or {})
        self._progress = progress

    def run(self) -> Result:
        """Simulate to the end, or until Ctrl-C, which leaves complete files and a result that says so.

        Raises:
            FtqpError: the log cannot be written.
        """
        self._forget_faults()
        self._arm.reset(self._q, self._v, self._last + 1)
        if self._log is None:
            return self._ticks(None)
        reference = "time" if self._leader.standing.status is None else "progress"
        about = description(self._planner, self._schedule, self._path, self._last, reference)
        about |= {"drive": self._plant.drive, "plant_tolerance": self._plant.tolerance}
        about |= self._metadata | {"state": "running"}
        if self._log == MEMORY:
            memory = MemoryRows(self._signals, about)
            return replace(self._recorded(memory), log=memory.log)
        log, of = self._log, (self._signals, about)
        tallied = TalliedRows(PartedLog(log, *of) if isinstance(log, LogParts) else LogWriter(log, *of), *of)
        try:
            result = self._recorded(tallied)
        finally:
            tallied.close()
        return replace(result, summary=tallied.facts())

    def _recorded(self, sink: RowSink) -> Result:
        """All ticks and their rows; the state of the log says how it ended once every row is kept."""
        recorder = TickRecorder(
            sink, self._planner, self._leader, sensed=self._arm.sensed, singularities=self._singularities
        )
        try:
            result = self._ticks(recorder)
            recorder.flush()
        except BaseException:
            with suppress(FtqpError):  # the first error counts; without a word the state stays "running"
                sink.annotate({"state": "failed"})
            raise
        sink.annotate(
            {
                "state": _state(result),
                "broken": result.broken,
                "path_finished": self._leader.standing.finished,
                "blocked": result.blocked,
                "detections": None if self._planner.diagnosis is None else _findings(self._planner),
                "learned": None if (found := self._planner.learned) is None else found.facts(),
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

    def _tick(self, k: int, recorder: TickRecorder | None) -> int:
        """One tick, and the arm moves on; the code of its status."""
        made = self._arm.plan_step(k)
        if recorder is not None:
            recorder.write(k * self._planner.dt, self._plant.q, self._plant.v, *made)
        code = made.step.code
        self._plant.advance(made.step)
        return code

    def _ticks(self, recorder: TickRecorder | None) -> Result:
        """All ticks."""
        planner, leader, plant, dt = self._planner, self._leader, self._plant, self._planner.dt
        failing, announced = self._schedule.failing(dt), self._schedule.announced(dt)
        counts = np.zeros(len(StepStatus), dtype=np.int64)
        done, stopped_at, code = 0, None, None
        said_last = clock.now()
        interrupted = False
        try:
            while done <= self._last:
                k = done
                for event in failing.get(k, ()):
                    plant.fail(event.fault)
                    if recorder is not None:
                        recorder.fail(event.fault)
                for event in announced.get(k, ()):
                    planner.report(event.fault)
                code, done = self._tick(k, recorder), k + 1
                counts[code] += 1
                if stopped_at is None and _STOPS[code]:
                    stopped_at = k * dt
                if self._progress is not None and clock.now() - said_last > PROGRESS_PERIOD:
                    said_last = clock.now()
                    self._progress(done, self._last + 1)
                if leader.standing.over or plant.failure is not None:
                    break
        except KeyboardInterrupt:
            interrupted = True
        if self._progress is not None:
            self._progress(done, self._last + 1)
        statuses, standing = list(StepStatus), leader.standing
        return Result(
            steps=done,
            completed=stopped_at is None and not interrupted and plant.failure is None and standing.finished,
            interrupted=interrupted,
            final_status=None if code is None else statuses[code],
            stopped_at=stopped_at,
            status_counts={
                status: int(count) for status, count in zip(statuses, counts, strict=True) if count
            },
            q=plant.q.copy(),
            v=plant.v.copy(),
            progress=standing.reached,
            blocked=standing.blocked,
            broken=plant.failure,
        )


def _findings(planner: Planner) -> list[dict[str, Any]]:
    """What the planner's detector found, for the log."""
    rows = [asdict(one) | {"kinds": sorted(one.kinds)} for one in planner.findings]
    return [{key: None if value != value else value for key, value in row.items()} for row in rows]


def _state(result: Result) -> str:
    """How a run ended, for its log."""
    if result.broken is not None:
        return "broken"
    return "interrupted" if result.interrupted else "finished"
