"""What a detector was made with, to be read."""

from typing import Any, Protocol

from ftqp.core.fixed import Fixed
from ftqp.faults.detection.calibration import Calibration
from ftqp.faults.detection.diagnosis import Diagnosis
from ftqp.model.robot import Robot

ANEW = "it was made with it; make another one, ftqp.Detector({name}=...)"
"""What to do about a setting."""


class Noisy(Protocol):
    """Standard deviations of what is measured, such as ``ftqp.Noise``."""

    @property
    def q(self) -> float: ...
    @property
    def tau(self) -> float: ...


class DetectorSettings:
    """What a detector was made with; ``ftqp.Detector`` says what each setting does."""

    __slots__ = ()
    robot: Fixed[Robot | None] = Fixed("_robot", "The arm; None where a planner will give it.", ANEW)
    dt: Fixed[float | None] = Fixed(
        "_dt", "The sampling period [s]; None where a planner will give it.", ANEW
    )
    drive: Fixed[Any] = Fixed("_drive", "What the arm takes.", ANEW)
    noise: Fixed[Noisy | None] = Fixed("_noise", "Standard deviations of the measurements.", ANEW)
    delay: Fixed[float | None] = Fixed("_delay", "How late samples are [s].", ANEW)
    false_alarms_per_hour: Fixed[float] = Fixed(
        "_false_alarms_per_hour", "How many false alarms an hour are allowed.", ANEW
    )
    bandwidths: Fixed[tuple[float, float]] = Fixed(
        "_bandwidths", "Of the slow and the fast observer [1/s].", ANEW
    )
    patience: Fixed[float] = Fixed(
        "_patience", "How long a loss of torque is fitted before it is named [s].", ANEW
    )
    quantum: Fixed[float] = Fixed("_quantum", "Smallest step of the encoders [rad or m]; 0 is none.", ANEW)
    calibration: Fixed[Calibration | None] = Fixed(
        "_calibration", "What was found on healthy motion; None: thresholds are guessed.", ANEW
    )
    probe_after: Fixed[float | None] = Fixed(
        "_probe_after", "After how long a joint at rest is probed [s]; None is never.", ANEW
    )
    diagnosis: Fixed[Diagnosis] = Fixed(
        "_diagnosis", "What is held for likely; it follows the detector.", "it follows what is measured"
    )
