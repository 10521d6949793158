"""What the arm takes, and with it who closes which loop."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, exp, inf, isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.control.drive.learned_servos import LearnedServos, known_from
from ftqp.core.checks import FloatArray, numbers
from ftqp.core.errors import InputError, nearest
from ftqp.core.setting import made_from, refuse_out_of_range, setting
from ftqp.kernel.layout.enums import DELAYS, Brakes, DriveKind
from ftqp.kernel.layout.feedback_rooms import LATER, PACES, SOFTER
from ftqp.kernel.layout.thresholds import LATELY, NOISE_OF_D

KINDS = {kind.name.lower(): kind for kind in DriveKind}
BRAKES = {brakes.name.lower(): brakes for brakes in Brakes}
KAPPA_UNKNOWN = 10.0
"""Bandwidth of the tip's loop [1/s] where the servo's is not known, ..."""
KAPPA_MOST = 25.0
"""... where it is known at most, ..."""
KAPPA_DELAY = 0.25
"""... and as a share of the inverse of the delay at most: so that the largest sensitivity stays below 2
(docs/theory/feedback.md, "The tip"), which tests/control/drive/test_joint_drive.py computes."""
KAPPA_RATTLE = 0.05
"""Acceleration [m/s2] that the noise of the tip may cause."""

HOLD_UNKNOWN, HOLD_MOST, HOLD_DELAY = 10.0, 50.0, 0.3
"""Position loop around a velocity arm: where its servo is not known and at most [1/s], and as a share of the
inverse of the delay ..."""
STIFFNESS_MOST, STIFFNESS_DELAY = 80.0, 0.24
"""... and the loop around a torque arm, at most [1/s] and as that share ..."""
STIFFNESS_UNSURE = 40.0
"""... and at most where its model may lack rotors and samples may come later than stated: what 5 ms and one
tick at 1 kHz leave of it. Nothing tells that a loop has room for more but that it shakes, too late."""

SOFTENS = 0.7
"""A loop that rings becomes softer by this share, and so half as stiff in its two steps."""

OBSERVER = 200.0
"""Bandwidth of the observer of position and velocity arms [1/s] ..."""
OBSERVER_SHARE, OBSERVER_LEAST = 5.0, 1.5
"""... and of a torque arm, as multiples of its stiffness: without noise, a guess that the campaigns have not
contradicted, and at least, so that a joint that is as heavy as the model says has a largest sensitivity below
2.3, which tests/control/drive/test_joint_drive.py computes."""
SHAKEN = 0.2
"""Noise alone may ask a torque arm for this share of its smallest acceleration limit (standard deviation):
half of that limit is then beyond two of them."""

OBSERVER_FAILED = 300.0
"""Bandwidth of the observer of a failed joint [1/s]."""
FEED_FORWARD_SHARE = 0.5
"""Bandwidth of the disturbance that is fed forward, as a share of the stiffness."""
ROTORS = 0.3
"""Rotor inertia that a model may lack [kg m2 or kg]: the largest of common arms behind their gears."""
LEARNING = 200.0
"""Bandwidth of the filters by which a torque arm is learned [1/s]: a wrist that falls under a load that
nobody has reported is known before it has fallen far ..."""
LEARNING_DT = 0.2
"""... as a share of the sampling rate at most ..."""
FELT = 0.1
"""... and so low that noise alone is an acceleration of no more than this [rad/s2 or m/s2]."""
FORGOTTEN = 16.0
"""After so many of their time constants filters have forgotten how they began, because 16^3/6 e^-16 is
8e-5."""
ESTIMATED = 0.005
"""From one estimate to the next [s]; a tick that makes one takes a microsecond more."""
REMEMBERED = 0.7
"""What was heard so long ago [s] counts e times less."""
PATIENCE = 0.02
"""How long a sensor may be refused before the arm is stopped [s]."""
_LOG = logging.getLogger("ftqp")
DOUBTFUL = 0.05
"""Noise of positions above this [rad or m], 3 deg or 5 cm, is no encoder's. A convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Standard deviations of what is measured; zero says that nothing is known.

    Attributes:
        q: Of joint positions, >= 0 [rad or m]. A larger one lets samples differ more from what is expected
            and corrects the end effector more slowly; where it is stated, a sensor that repeats its number
            while the joint moves counts as frozen sooner. More than 0.05 is a warning on the logger ``ftqp``.
        tau: Of joint torques, >= 0 [N m or N].

    Raises:
        InputError: A number is negative or not finite.
    """

    q: float = setting(0.0, unit="rad or m", least=0.0)
    tau: float = setting(0.0, unit="N m or N", least=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the noise")
        if self.q > DOUBTFUL:
            _LOG.warning(
                "Noise(q=%g) is more than any encoder has, so that nearly every sample is believed; it is a "
                "standard deviation in rad or m, such as 1e-4: is it in degrees or in counts?",
                self.q,
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """What the arm takes, and what is known of the loop inside it.

    Attributes:
        kind: What the arm takes: of ``position`` send ``step.q``, and ``step.v`` where the arm takes it as
            well, of ``velocity`` ``step.v``, and of ``torque`` ``step.tau``.
        bandwidth: Of the arm's own servo, > 0 [rad/s], or one of each joint, (nv,); None is unknown. On drive
            ``position`` the planner estimates each servo, and begins with this, believed to 10 %. On
            ``velocity``, and where the end effector is measured, a larger one lets the end effector's error
            be taken back faster, and stating more than the servo has makes the loop ring. Of several the
            slowest counts for loops, and the fastest for ``lead``, so that no joint is sent farther ahead
            than it lags.
        takes_velocity: Whether the servo of a position arm is fed ``step.v``, too. One that is not lags by
            about 2/bandwidth.
        lead: How far ahead of the reference positions are sent until more is known of the servo, >= 0 [s];
            None is 2/bandwidth for a servo on positions only whose bandwidth is known, else 0.
        latency: How late samples are when ``step`` gets them, >= 0 [s]; it is rounded to whole ticks. A
            larger one lowers every loop's bandwidth; on drive ``position`` what is later than this counts as
            lag. A torque arm that estimates its inertia finds, too, that samples come up to five ticks later
            than is said here.
        stiffness: Bandwidth of the loop around the reference of a torque arm, > 0 [1/s]; None is
            min(40, 0.24/(latency + dt)), or 80 in place of 40 with ``inertia_error`` 0. A larger one holds
            better against friction and loads, and less well against a wrong model.
        inertia_error: How much rotor inertia the model of a torque arm's joint may lack, >= 0 [kg m2 or kg];
            None is 0.3. Rotors, a load at the end effector and dry friction are then estimated while the arm
            moves. With a larger one disturbances are fed forward more slowly until the rotors are known; 0
            takes the model as it is.
        brakes: Which brakes the arm has. ``each``: one a joint, and ``step.brakes`` names those to close.
            ``all``: they close together, so that once one is asked for all are, the arm is stopped, and it
            goes on after ``reset`` only. ``none``: ``step.brakes`` names none, and a joint that is out of
            hand keeps its own loop; the arm is held by the motors that are left.
        known: Estimates of the servos of a position arm, to begin with: a file that ``ftqp connect``
            or ``connection.save`` wrote, or ``planner.learned``; None is nothing. It says more than
            ``bandwidth``, and is doubted as much as that; what has changed since is estimated anew.

    Raises:
        InputError: An unknown kind, a number out of its range, or one that this kind has no use for.

    Source: docs/theory/feedback.md; docs/theory/monitor.md, "The model of a joint".
    """

    kind: str = setting("position", choices=tuple(KINDS))
    bandwidth: float | Sequence[float] | None = setting(None, of=float | None, unit="rad/s", above=0.0)
    takes_velocity: bool = setting(True)
    lead: float | None = setting(None, unit="s", least=0.0)
    latency: float = setting(0.0, unit="s", least=0.0)
    stiffness: float | None = setting(None, unit="1/s", above=0.0)
    inertia_error: float | None = setting(None, unit="kg m2 or kg", least=0.0)
    brakes: str = setting("each", choices=tuple(BRAKES))
    known: LearnedServos | str | Path | None = setting(None, of=str | None, file=True)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(
                f"drive is {self.kind!r}{nearest(str(self.kind), KINDS)}, expected one of {', '.join(KINDS)}"
            )
        for name in ("lead", "known", "stiffness", "inertia_error"):
            owner = "position" if name in ("lead", "known") else "torque"
            if getattr(self, name) is not None and self.kind != owner:
                raise InputError(
                    f"{name} is for drive {owner!r}, but the drive is {self.kind!r}; leave it out"
                )
        if self.known is not None:
            if self.bandwidth is not None:
                raise InputError(
                    "bandwidth and known both say how the servos of the drive lag; leave bandwidth out"
                )
            object.__setattr__(self, "known", known_from(self.known))
        if not isinstance(self.bandwidth, int | float | None):
            each = numbers("bandwidth of the drive", self.bandwidth)
            if each.ndim > 1 or not each.size:
                raise InputError(
                    f"bandwidth of the drive has shape {each.shape}, expected a number or one of each joint"
                )
            object.__setattr__(self, "bandwidth", tuple(each.tolist()) if each.ndim else float(each))
        refuse_out_of_range(self, " of the drive")
        if not self.takes_velocity and self.kind != "position":
            raise InputError(
                f"takes_velocity=False is for drive 'position', but the drive is {self.kind!r}; leave it out"
            )

    @property
    def slowest(self) -> float | None:
        """The bandwidth of the slowest servo [rad/s]; None where it is unknown."""
        return min(self.bandwidth) if isinstance(self.bandwidth, Sequence) else self.bandwidth

    @property
    def fastest(self) -> float | None:
        """The bandwidth of the fastest servo [rad/s]; None where it is unknown."""
        return max(self.bandwidth) if isinstance(self.bandwidth, Sequence) else self.bandwidth

    def refuse_others(self, joints: Sequence[str]) -> None:
        """Refuse a drive of another number of joints.

        Args:
            joints: The names of the robot's joints, (nv,).

        Raises:
            InputError: It has a bandwidth of each joint, and there are more or fewer; or what is known was
                estimated of another arm.
        """
        if isinstance(self.known, LearnedServos):
            self.known.refuse_others(tuple(joints))
        if isinstance(self.bandwidth, Sequence) and len(self.bandwidth) != len(joints):
            raise InputError(
                f"bandwidth of the drive has shape ({len(self.bandwidth)},), expected (nv,) = "
                f"({len(joints)},), of {', '.join(joints)}, or one number"
            )

    @property
    def doubt(self) -> float:
        """Rotor inertia that a joint's model may lack [kg m2 or kg]."""
        return ROTORS if self.inertia_error is None else self.inertia_error

    @property
    def learns(self) -> bool:
        """Whether what the model lacks is estimated, and how late samples come."""
        return self.kind == "torque" and self.doubt > 0.0

    def ticks(self, dt: float) -> int:
        """The latency in whole ticks.

        Args:
            dt: The sampling period [s].

        Raises:
            InputError: The latency is longer than can be kept.
        """
        ticks = round(self.latency / dt)
        if ticks > DELAYS - 2:
            raise InputError(
                f"latency of the drive is {self.latency:g} s, expected at most {(DELAYS - 2) * dt:g} s, "
                f"{DELAYS - 2} samples"
            )
        return ticks

    def gains(self, dt: float, noise: Noise, reach: float, a_max: float = inf) -> dict[str, float]:
        """Bandwidths of every loop, by their names in the record's room ``feedback``, and ``lead``.

        Args:
            dt: The sampling period [s].
            noise: What is measured, how noisily.
            reach: The arm's reach [m].
            a_max: The smallest acceleration limit of the arm's joints [rad/s2 or m/s2].
        """
        delay = (self.ticks(dt) + 1) * dt
        most = STIFFNESS_UNSURE if self.learns else STIFFNESS_MOST
        w = min(most, STIFFNESS_DELAY / delay) if self.stiffness is None else self.stiffness
        if self.kind == "torque":
            own = 0.5 * w
        elif self.slowest is None:
            own = KAPPA_UNKNOWN
        else:
            own = self.slowest / (2.0 if self.takes_velocity else 4.0)
        rattles = sqrt(KAPPA_RATTLE / (noise.q * reach)) if noise.q > 0.0 else float("inf")
        hold = HOLD_UNKNOWN if self.slowest is None else self.slowest / 4.0
        lead = self.lead
        if lead is None:
            lead = 2.0 / self.fastest if self.fastest is not None and not self.takes_velocity else 0.0
        observer = observer_of(w, SHAKEN * a_max, noise.q * sqrt(dt)) if self.kind == "torque" else OBSERVER
        return {
            "kappa": min(own, KAPPA_DELAY / delay, KAPPA_MOST, rattles),
            "hold": min(hold, HOLD_DELAY / delay, HOLD_MOST),
            "lead": lead,
            "stiffness": w,
            "pole": exp(-observer * dt),
            "pole_failed": exp(-OBSERVER_FAILED * dt),
            "failed_noise": OBSERVER_FAILED * sqrt(OBSERVER_FAILED * dt),
            "missing_noise": NOISE_OF_D * observer * sqrt(observer * dt / 3.0) / LATELY,  # of d^ in its mean
            "sigma": noise.q,
            "patience": PATIENCE,
        }

    def paces(self, dt: float, noise: Noise, reach: float, a_max: float) -> FloatArray:
        """What a torque arm's gains are, (SOFTER + 1, ticks, PACES).

        Each row of the first axis has a softer loop, each of the second one samples that come a tick later.

        Args:
            dt: The sampling period [s].
            noise: What is measured, how noisily.
            reach: The arm's reach [m].
            a_max: The smallest acceleration limit of the arm's joints [rad/s2 or m/s2].
        """
        most = min(LATER, DELAYS - 2 - self.ticks(dt)) if self.learns else -1
        rows = []
        for softer in range(SOFTER + 1):
            for later in range(most + 1):
                drive = replace(self, latency=self.latency + later * dt)
                w = SOFTENS**softer * drive.gains(dt, noise, reach, a_max)["stiffness"]
                drive = replace(drive, stiffness=w)
                gains = drive.gains(dt, noise, reach, a_max) | {"gain": drive.learning(dt, noise)["gain"]}
                rows.append([gains[name] for name in PACES])
        return np.reshape(np.array(rows), (SOFTER + 1, most + 1, len(PACES)))

    def learning(self, dt: float, noise: Noise) -> dict[str, float]:
        """How the arm is estimated, by the names of the record's room ``learned``.

        Args:
            dt: The sampling period [s].
            noise: What is measured, how noisily.
        """
        w = self.gains(dt, noise, 1.0)["stiffness"]
        rate = min(LEARNING, LEARNING_DT / dt)
        if noise.q > 0.0:
            rate = min(rate, (FELT / (NOISE_OF_D * noise.q * sqrt(dt))) ** 0.4)
        every = max(1, round(ESTIMATED / dt))
        gain = 1.0 - exp(-FEED_FORWARD_SHARE * w * dt)
        return {
            "on": int(self.learns),
            "start": ceil(FORGOTTEN / (rate * dt)),
            "every": every,
            "pole": 1.0 - exp(-rate * dt),
            "forget": exp(-every * dt / REMEMBERED),
            "doubt": self.doubt,
            "gain": gain,
            "felt": felt(rate, dt),
            "slowness": gain,
        }


def observer_of(w: float, most: float, noise: float) -> float:
    """Bandwidth of the observer with which noise alone asks a torque arm for ``most`` acceleration [1/s].

    w^2 q^ + 2 w v^ of white noise has, with x = w_o/w, the standard deviation

        sigma sqrt(dt) w^(5/2) sqrt(x (112 x^2 + 108 x + 33)/16),

    and x stays between 1.5 and 5. A slower observer costs less than a softer loop: for as much noise a
    disturbance moves the joint by 0.6 of what it would there.

    Source: docs/theory/feedback.md, "The observer".
    """
    if noise <= 0.0 or most >= asked(w, OBSERVER_SHARE, noise):
        return OBSERVER_SHARE * w
    x = float(max(np.roots([112.0, 108.0, 33.0, -16.0 * (most / noise) ** 2 / w**5]).real))
    return max(OBSERVER_LEAST, x) * w


def asked(w: float, x: float, noise: float) -> float:
    """Standard deviation of what noise alone asks a torque arm for, see ``observer_of`` [rad/s2 or m/s2]."""
    return noise * w * w * sqrt(w * x * (112.0 * x * x + 108.0 * x + 33.0) / 16.0)


def felt(rate: float, dt: float) -> float:
    """Standard deviation of the second difference of filtered white noise, by that of the noise [1/s2].

    Four poles p in a row answer an impulse by (1 - p)^4 (k + 1)(k + 2)(k + 3)/6 p^k.
    """
    p, k = exp(-rate * dt), np.arange(ceil(40.0 / (rate * dt)))
    answer = (1.0 - p) ** 4 * (k + 1.0) * (k + 2.0) * (k + 3.0) / 6.0 * p**k
    return float(np.linalg.norm(np.diff(answer, 2, prepend=[0.0, 0.0]))) / dt**2


def by_name(drive: Drive | str | Mapping[str, Any]) -> Drive:
    """The drive of that name or table."""
    if isinstance(drive, Drive):
        return drive
    if isinstance(drive, str):
        return Drive(kind=drive)
    if not isinstance(drive, Mapping):
        raise InputError(
            f"drive is {drive!r:.60}, expected one of {', '.join(KINDS)}, a table, or an ftqp.Drive"
        )
    for key, value in drive.items():
        if isinstance(value, float) and not isfinite(value):
            raise InputError(f"{key} of the drive is {value}, expected a finite number")
    return made_from(Drive, drive, "a drive")
