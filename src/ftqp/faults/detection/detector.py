"""The detector: which joint has failed, how, and since when, from what is measured of the arm."""

from collections.abc import Callable, Iterable
from typing import Any, ClassVar, Self, final

import numpy as np

from ftqp.core.checks import instance, non_negative, positive
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import Setting, Settings
from ftqp.faults.detection.calibrating import calibrated
from ftqp.faults.detection.calibration import Calibration
from ftqp.faults.detection.detector_record import fill_record
from ftqp.faults.detection.detector_settings import DetectorSettings, Noisy
from ftqp.faults.detection.diagnosis import Diagnosis
from ftqp.faults.detection.motion_log import MotionLog, RecordedRun, motion_of
from ftqp.faults.kinds import Fault, refuse_unknown
from ftqp.kernel.entry.detection_session import DetectionSession
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import DELAYS, DriveKind, Mistake, ToldDetector
from ftqp.model.robot import Robot

DRIVES = tuple(kind.name.lower() for kind in DriveKind)
TORQUE = DriveKind.TORQUE.name.lower()
SETTINGS = (
    "robot", "dt", "drive", "noise", "delay", "false_alarms_per_hour", "bandwidths", "patience", "quantum",
    "calibration", "probe_after",
)  # fmt: skip
"""Arguments of a detector, each an attribute of the same name."""
NO_ARM = "the detector knows no arm yet; give robot= and dt=, or hand it to ftqp.Planner(detector=...)"
NOTHING = np.zeros(0)
"""Stands for torques that are not there."""
RETHINK = 40
"""Ticks without verdicts after a finding was taken back."""


@final
class Detector(DetectorSettings):
    """Looks at what is measured of an arm and says which joint fails, how, and since when.

    ``update`` is called once a tick with what was measured and with the step that was made of it. A detector
    knows its arm from the start, or gets to know it from a planner through ``for_arm``.

    Planners on drive ``torque`` use all of it. Those on ``position`` and ``velocity`` detect failures
    without it, and take ``false_alarms_per_hour`` alone.

    Args:
        robot: The arm; None where a planner will give it.
        dt: The sampling period, > 0 [s]; None where a planner will give it.
        drive: What the arm takes: ``position``, ``velocity`` or ``torque``, or an ``ftqp.Drive``, whose
            latency is then the delay.
        noise: Standard deviations of positions and torques, an ``ftqp.Noise``. More noise means larger
            thresholds and later findings.
        delay: How late samples are, >= 0 [s]; None is that of the drive, or none.
        false_alarms_per_hour: How often a healthy arm may be suspected, > 0 [1/h]; used by ``calibrate``, and
            by a planner on drives ``position`` and ``velocity`` for a joint that is named. A smaller one
            names it later.
        bandwidths: Of the slow and of the fast observer, > 0 [1/s]. A faster one sees a fault sooner and
            passes on more noise.
        patience: How long a loss of torque is fitted before it is named, >= 0 [s]. A longer one names the
            share better and later.
        quantum: Smallest step of the encoders, >= 0 [rad or m]; 0 is none. Where it exceeds the noise, a
            frozen encoder cannot be told from a brake.
        calibration: What ``calibrate`` found on healthy motion. Without one the thresholds are guessed from
            the noise and the arm's limits, and no rate of false alarms is known.
        probe_after: How long a joint stands before a planner moves it by 1 to 2 mrad along self-motions, to
            see whether it can, > 0 [s]; None is never. A shorter time shows a lock at rest sooner and moves
            the arm more often.

    Raises:
        InputError: A number is out of its range, or the calibration is of another arm, drive or delay.

    Source: docs/theory/detection.md; docs/theory/monitor.md.
    """

    __slots__ = (
        "_bandwidths", "_calibration", "_delay", "_detect", "_diagnosis", "_drive", "_dt",
        "_false_alarms_per_hour", "_names", "_noise", "_patience", "_probe_after", "_quantum", "_robot",
        "_session", "_ticks", "_torques",
    )  # fmt: skip

    settings: ClassVar[Settings] = {
        "bandwidths": Setting(unit="1/s"),
        "patience": Setting(unit="s", least=0.0),
        "quantum": Setting(unit="rad or m", least=0.0),
        "probe_after": Setting(unit="s", above=0.0),
        "calibration": Setting(
            "a file made by a calibration; thresholds are guessed from the noise if absent",
            of=str | None,
            file=True,
        ),
    }

    def __init__(
        self,
        *,
        robot: Robot | None = None,
        dt: float | None = None,
        drive: Any = None,
        noise: Noisy | None = None,
        delay: float | None = None,
        false_alarms_per_hour: float = 0.1,
        bandwidths: tuple[float, float] = (60.0, 200.0),
        patience: float = 0.022,
        quantum: float = 0.0,
        calibration: Calibration | None = None,
        probe_after: float | None = None,
    ) -> None:
        self._false_alarms_per_hour = positive("false_alarms_per_hour", false_alarms_per_hour, "1/h")
        slow, fast = (positive("bandwidths of the detector", w, "1/s") for w in bandwidths)
        if not slow < fast:
            raise InputError(f"bandwidths are {bandwidths}, expected the slow one first, as in (60.0, 200.0)")
        self._bandwidths = (slow, fast)
        self._patience = non_negative("patience of the detector", patience, "s")
        self._quantum = non_negative("quantum of the encoders", quantum, "rad or m")
        self._calibration = calibration
        self._probe_after = None if probe_after is None else positive("probe_after", probe_after, "s")
        self._robot, self._dt, self._noise = robot, dt, noise
        self._drive: str | None = _drive(drive)
        latency = getattr(drive, "latency", None) if delay is None else delay
        self._delay = None if latency is None else non_negative("delay of the detector", latency, "s")
        self._session: DetectionSession | None = None
        self._torques = False
        self._detect: Callable[..., int] = _knows_no_arm
        if robot is not None and dt is not None:
            self._build(robot, dt)

    def for_arm(
        self,
        robot: Robot,
        dt: float,
        *,
        drive: Any = None,
        noise: Noisy | None = None,
        delay: float | None = None,
    ) -> Self:
        """A working detector with these settings for what they leave open.

        Args:
            robot: The arm.
            dt: The sampling period [s].
            drive: What the arm takes.
            noise: Of the measurements.
            delay: How late samples are [s].

        Raises:
            InputError: As at construction.
        """
        given = type(self)(drive=drive, delay=delay)
        offered = {"robot": robot, "dt": dt, "drive": given.drive, "noise": noise, "delay": given.delay}
        return self._but_with(**{key: value for key, value in offered.items() if getattr(self, key) is None})

    def _but_with(self, **changes: Any) -> Self:
        """A detector with these settings, some of them changed."""
        return type(self)(**({name: getattr(self, name) for name in SETTINGS} | changes))

    def _build(self, robot: Robot, dt: float) -> None:
        """The record, for this arm."""
        instance("robot of the detector", robot, Robot, "an ftqp.Robot")
        self._dt = dt = positive("dt of the detector", dt, "s")
        self._drive = "position" if self.drive is None else self.drive
        ticks = round((self.delay or 0.0) / dt)
        if ticks > DELAYS - 3:
            raise InputError(
                f"delay of the detector is {self.delay:g} s, expected at most {(DELAYS - 3) * dt:g} s, "
                f"{DELAYS - 3} samples"
            )
        self._ticks = ticks
        self._torques = self.drive == TORQUE
        session = self._session = DetectionSession(robot.chain.constants())
        session.D.from_command = int(self._torques)
        if self.calibration is not None:
            self.calibration.refuse_others(robot.joints, self.drive, dt, self.bandwidths, ticks)
        fill_record(session.D, self, robot, dt, ticks)
        self._names = robot.joints
        self._detect = session.detect()
        self._diagnosis = Diagnosis(robot.joints, self._seen)
        self._restart()

    def _seen(self, name: str) -> Any:
        """What a diagnosis reads: a field of the record, or means of speeds over the last samples."""
        session = self._working()
        if name == "speed":
            kept = np.roll(session.field("kept"), -1 - int(session.D.at), axis=0)
            part = len(kept) // 4
            moved = kept[-part:].mean(axis=0) - kept[:part].mean(axis=0)
            return np.abs(moved) / ((len(kept) - part) * float(session.D.dt))
        if name == "asked":
            return np.abs(np.roll(session.field("kept_v"), -1 - int(session.D.at), axis=0)[-50:].mean(axis=0))
        return session.field(name)

    def _working(self) -> DetectionSession:
        if self._session is None:
            raise InputError(NO_ARM)
        return self._session

    def _restart(self) -> None:
        self._working().tell(ToldDetector.ANEW)

    def reset(self, q: Any = None) -> None:
        """Begin anew: what was found is forgotten, sensors are believed again, failed joints are not.

        Args:
            q: Where the arm is, (nv,) [rad or m]; it is taken from the first samples.

        Raises:
            InputError: q has another shape.
        """
        session = self._working()
        if q is not None and np.shape(q) != (session.D.n,):
            raise InputError(f"q has shape {np.shape(q)}, expected (nv,) = ({session.D.n},)")
        self._restart()

    @property
    def memory(self) -> Any:
        """The record of a detector that knows its arm, (1,), for ``ftqp build``."""
        return self._working().memory

    def beside(self, planner: Session) -> Callable[[int], int]:
        """The compiled tick beside a planner, which also tells what it has learned of its arm.

        Args:
            planner: Its session.

        Returns:
            What is called after its tick with the address of measured torques, (nv,) [N m or N], or 0. It
            answers 0 where all is quiet, 1 during a suspicion, 2 at a finding.
        """
        return self._working().watch(planner)

    def update(self, q: Any, v: Any, tau: Any, command: Any) -> Diagnosis:
        """One tick.

        Args:
            q: Measured positions, (nv,) [rad or m]; NaN where there is none.
            v: Measured velocities; not looked at, since those of encoders tell nothing new. May be None.
            tau: Measured torques, (nv,) [N m or N], or None. Whether there are any is settled by the first
                tick after a reset.
            command: The planner's step of this tick, or an ``ftqp.Commanded``: the reference at the tick's
                end, and the torques that are sent or that the drive asks for.

        Returns:
            The diagnosis, the same object every tick.

        Raises:
            InputError: Something has a wrong shape, or the detector knows no arm.
        """
        reference = getattr(command, "reference", command)
        effort = command.tau if self._torques else getattr(command, "demand", None)
        code = self._detect(
            q,
            NOTHING if tau is None else tau,
            reference.q,
            reference.v,
            reference.a,
            NOTHING if effort is None else effort,
        )
        if code < 0:
            self._again(code, q, tau, reference, effort)
        return self.diagnosis

    def _again(self, code: int, q: Any, tau: Any, reference: Any, effort: Any) -> None:
        """The same tick with arrays made of what was given, or the sentence that says what is wrong."""
        n = len(self._names)
        given = {
            "q": q, "tau": tau, "q of the reference": reference.q, "v of the reference": reference.v,
            "a of the reference": reference.a, "torques of the command": effort,
        }  # fmt: skip
        arrays = []
        for name, value in given.items():
            if value is None:
                arrays.append(NOTHING)
                continue
            try:
                one = np.ascontiguousarray(value, dtype=np.float64)
            except (TypeError, ValueError, OverflowError) as error:
                raise InputError(f"{name} is no array of numbers, expected (nv,) = ({n},)") from error
            if one.shape != (n,):
                raise InputError(f"{name} has shape {one.shape}, expected (nv,) = ({n},)")
            arrays.append(one)
        if code == Mistake.WRONG_SHAPE or self._detect(*arrays) < 0:
            raise InputError(f"q, tau or the command has another size than the arm, (nv,) = ({n},)")

    def fit(self, robot: Robot) -> None:
        """Count on another load or tool of the same arm from the next tick on.

        Args:
            robot: The arm as it is now, of the same joints.

        Raises:
            InputError: It has other joints.
        """
        session = self._working()
        if robot.joints != self._names:
            raise InputError(
                f"{robot.name} has joints {robot.joints}, expected those of the detector, {self._names}"
            )
        session.fit(robot.chain.constants())
        session.tell(ToldDetector.LOAD)

    def believe(self, fault: Fault) -> None:
        """A planner believes in a fault: that joint is not diagnosed again, the others are.

        Args:
            fault: What it believes.

        Raises:
            InputError: The joint is unknown, or this is no fault.
        """
        refuse_unknown(fault)
        self._working().tell(ToldDetector.FAILED, self._index(fault.joint))

    def forget(self, joint: str | int) -> None:
        """Look at a joint again, and believe its sensor.

        Args:
            joint: Its name or its 0-based index.

        Raises:
            InputError: The joint is unknown.
        """
        self._working().tell(ToldDetector.WORKS, self._index(joint))

    def doubt(self, joint: str | int) -> None:
        """Take the finding of a joint back and judge it anew in a while, with all that was observed.

        Args:
            joint: Its name or its 0-based index.

        Raises:
            InputError: The joint is unknown.
        """
        i, D = self._index(joint), self._working().D
        D.kinds[i] = D.waiting = D.agreed = 0
        D.pause = RETHINK

    def _index(self, joint: str | int) -> int:
        if self.robot is None:
            raise InputError(NO_ARM)
        return int(self.robot.chain.lead[self.robot.joint(joint)])

    def wants_probing(self, joint: str | int) -> bool:
        """Whether a small motion of a joint, 1 to 2 mrad, would tell what its rest hides.

        Args:
            joint: Its name or its 0-based index.
        """
        return self.diagnosis.of(self._names[self._index(joint)]).wants_probing

    def calibrate(
        self,
        log: MotionLog | RecordedRun | Iterable[MotionLog | RecordedRun],
        false_alarms_per_hour: float | None = None,
        *,
        extrapolate: bool = False,
    ) -> Self:
        """A detector whose thresholds, noise and friction are those of healthy motion.

        Args:
            log: Motion of the healthy arm, or the log of a run, ``ftqp.load_log(run)``, or several of them,
                with standstill, reversals and the loads that it may carry.
            false_alarms_per_hour: How often it may be suspected without reason, > 0 [1/h]; None is what the
                detector was made with. Fewer alarms mean larger thresholds.
            extrapolate: Whether to set thresholds for fewer alarms than the log's length can show; the
                calibration then says so.

        Raises:
            InputError: The log is shorter than 50 s or too short for the rate, is not healthy, lets a joint
                rest all the time, or is noisier than was stated.
        """
        session = self._working()
        rate = self.false_alarms_per_hour if false_alarms_per_hour is None else false_alarms_per_hour
        given = [log] if isinstance(log, MotionLog | RecordedRun) else list(log)
        assert self.robot is not None and self.dt is not None and self.drive is not None
        about = (self.robot.joints, self.dt, self.drive)
        logs = [one if isinstance(one, MotionLog) else motion_of(one, *about) for one in given]
        rate = positive("false_alarms_per_hour", rate, "1/h")
        found = calibrated(
            self, session.copy(), self.robot, self.dt, self._ticks, logs, rate, extrapolate=extrapolate
        )
        return self._but_with(false_alarms_per_hour=rate, calibration=found)


def _drive(drive: Any) -> str | None:
    """The kind of a drive given as a word or as an ``ftqp.Drive``."""
    kind = getattr(drive, "kind", drive)
    if kind is not None and kind not in DRIVES:
        raise unknown("drive", kind, "a detector", DRIVES)
    return kind if kind is None else str(kind)


def _knows_no_arm(*given: Any) -> int:
    """In place of the compiled tick."""
    raise InputError(NO_ARM)
