"""What was learned of the position servos of an arm: in numbers, in sentences, and in a file."""

import json
from dataclasses import dataclass
from math import floor, isfinite, log10, pi
from pathlib import Path
from typing import Any, Final, Self, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, array, read_only
from ftqp.core.errors import InputError, reading
from ftqp.kernel.layout.feedback_rooms import SERVO
from ftqp.kernel.layout.thresholds import SERVO_PRIOR

FORMAT: Final = 1
"""Version of the file."""
PARAMETERS: Final = ("lag", "rotor", "friction", "offset", "weight", "inertia")
"""The columns of ``values``, by their names in the file."""
FIGURES: Final = ("noise", "way")
"""What the file has of each joint without a standard deviation."""
UNKNOWN: Final = 0.5 * SERVO_PRIOR[0]
"""A lag that is open by as much [s] is not known: half of what is open before anything was learned."""
SURE: Final = 2.0
"""What is so many standard deviations from zero is said to be there."""
UNITS: Final = {"rad": "mrad", "m": "mm"}
"""What a thousandth of a joint's unit is called."""
AGAIN: Final = "connect the arm anew, ftqp.connect(planner, q) or `ftqp connect`"
"""The remedy for a file that does not fit."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LearnedServos:
    """What is known of the servos of an arm that takes positions, as estimated while it moved.

    u = y + lag v + rotor a + friction sgn(v) + offset + weight g(q) + inertia (M(q) a)

    u is what a joint is sent, y, v and a what is then measured, g and M a the model's torques in units of a
    fifth of the torque limit. ``Drive(known=...)`` lets another planner begin with it.

    Attributes:
        robot: The arm's name.
        joints: The joints' names, (nv,).
        units: The unit of each joint, ``rad`` or ``m``, (nv,).
        values: Lag [s], rotor over stiffness [s2], dry friction over it, and sags: the constant one, that
            under the arm's weight and that under what its inertia takes [rad or m], (nv, 6).
        deviations: Their standard deviations, (nv, 6). Noise of samples that hides the accelerations draws
            the rotor towards zero, which its own does not tell.
        droop: How far each joint stands below what it is sent at the present posture, (nv,) [rad or m].
        droop_error: Its standard deviation, (nv,).
        noise: Standard deviation of the samples of each joint, (nv,) [rad or m].
        way: How far each joint went while it was estimated, (nv,) [rad or m].

    Source: docs/theory/monitor.md, "The model of a joint".
    """

    robot: str
    joints: tuple[str, ...]
    units: tuple[str, ...]
    values: FloatArray
    deviations: FloatArray
    droop: FloatArray
    droop_error: FloatArray
    noise: FloatArray
    way: FloatArray

    def __post_init__(self) -> None:
        read_only(self)

    @property
    def lag(self) -> FloatArray:
        """How late each joint follows, delays included, (nv,) [s]; that of a servo on positions is 2/w_n."""
        return self.values[:, 0]

    @property
    def lag_error(self) -> FloatArray:
        """Its standard deviation, (nv,) [s]."""
        return self.deviations[:, 0]

    @property
    def friction(self) -> FloatArray:
        """By how much a joint stays behind through dry friction, (nv,) [rad or m]."""
        return self.values[:, 2]

    @property
    def friction_error(self) -> FloatArray:
        """Its standard deviation, (nv,) [rad or m]."""
        return self.deviations[:, 2]

    @property
    def is_known(self) -> BoolArray:
        """Of which joints the lag is known by now, (nv,): to half of what was open before they moved."""
        result: BoolArray = self.lag_error < UNKNOWN
        return result

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is known of each joint, a sentence each, (nv,)."""
        return tuple(self._sentence(i) for i in range(len(self.joints)))

    def __str__(self) -> str:
        """The sentences, a line each."""
        return "\n".join(self.sentences)

    def _sentence(self, i: int) -> str:
        name, unit = self.joints[i], UNITS[self.units[i]]
        if not self.is_known[i]:
            return f"Nothing of {name} is known yet: it has moved by {1e3 * self.way[i]:.2g} {unit}."
        lag, error = float(self.lag[i]), float(self.lag_error[i])
        if lag > SURE * error:
            said = f"lags by {with_error(1e3 * lag, 1e3 * error)} ms (a servo of about {hertz(lag):.2g} Hz)"
        else:
            said = f"lags by no more than {1e3 * (lag + SURE * error):.2g} ms"
        parts = [f"{name} {said}"]
        for value, spread, what in (
            (abs(float(self.droop[i])), float(self.droop_error[i]), "stands {} off what it is sent"),
            (float(self.friction[i]), float(self.friction_error[i]), "is held back by friction over {}"),
        ):
            if value > SURE * spread:
                parts.append(what.format(f"{with_error(1e3 * value, 1e3 * spread)} {unit}"))
        return f"{', '.join(parts)}; its samples scatter by {1e3 * self.noise[i]:.2g} {unit}."

    def facts(self) -> dict[str, Any]:
        """The same as anything JSON can hold, by joint: values with their standard deviations."""
        joints = {}
        for i, name in enumerate(self.joints):
            pairs = zip(PARAMETERS, self.values[i].tolist(), self.deviations[i].tolist(), strict=True)
            joints[name] = {
                "unit": self.units[i],
                **{key: [_short(value), _short(error)] for key, value, error in pairs},
                "droop": [_short(self.droop[i]), _short(self.droop_error[i])],
                **{key: _short(getattr(self, key)[i]) for key in FIGURES},
            }
        return {"robot": self.robot, "joints": joints}

    def refuse_others(self, joints: tuple[str, ...]) -> None:
        """Refuse a planner of another arm.

        Args:
            joints: The names of its joints, (nv,).

        Raises:
            InputError: They are not those of the estimates.
        """
        if joints != self.joints:
            raise InputError(
                f"known of the drive was estimated on {self.robot} with joints {', '.join(self.joints)}, but "
                f"this robot has {', '.join(joints)}; {AGAIN}"
            )

    def save(self, path: str | Path) -> None:
        """Write it as JSON.

        Args:
            path: The file; one that exists is replaced.

        Raises:
            InputError: It cannot be written.
        """
        try:
            Path(path).write_text(
                json.dumps({"format": FORMAT, **self.facts()}, indent=1) + "\n", encoding="utf-8"
            )
        except OSError as error:
            raise InputError(
                f"{path} cannot be written: {error.strerror or error}; name a file in a folder that is "
                "there and yours"
            ) from error

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what ``save`` wrote.

        Args:
            path: The file.

        Raises:
            InputError: The file cannot be read, or is none of this version.
        """
        with reading(path, "a file with estimates of servos", AGAIN):
            content = json.loads(Path(path).read_text(encoding="utf-8"))
            if content["format"] != FORMAT:
                raise InputError(
                    f"{path} has format {content['format']!r:.20}, expected estimates of servos in "
                    f"format {FORMAT}; {AGAIN}"
                )
            names, rows = tuple(content["joints"]), content["joints"].values()
            pairs = np.array([[row[key] for key in (*PARAMETERS, "droop")] for row in rows], dtype=np.float64)
            figures = {key: np.array([row[key] for row in rows], dtype=np.float64) for key in FIGURES}
            spread = [pairs[:, :, 1], *figures.values()]
            units = tuple(row["unit"] for row in rows)
            if not (np.isfinite(pairs).all() and all((part >= 0.0).all() for part in spread)):
                raise ValueError("a number is none, or a standard deviation is negative")
            if not set(units) <= set(UNITS):
                raise ValueError("the unit of a joint is neither rad nor m")
            return cls(
                robot=str(content["robot"]), joints=names, units=units, values=pairs[:, :-1, 0],
                deviations=pairs[:, :-1, 1], droop=pairs[:, -1, 0], droop_error=pairs[:, -1, 1], **figures,
            )  # fmt: skip


def known_from(given: Any) -> LearnedServos:
    """What a drive is said to be known by: the object, or its file."""
    if isinstance(given, LearnedServos):
        array("values of what is known", given.values, (len(given.joints), SERVO), "(nv, 6)")
        return given
    if isinstance(given, str | Path):
        return LearnedServos.load(given)
    raise InputError(
        f"known of the drive is {given!r:.60}, expected a file that `ftqp connect` wrote, or planner.learned"
    )


def _short(value: Any) -> float:
    """A number to six digits, which is more than is known."""
    return float(f"{float(value):.6g}")


def hertz(lag: float) -> float:
    """The corner of a critically damped servo on positions that lags by 2/w_n [s], in Hz."""
    return 1.0 / (pi * lag)


def with_error(value: float, error: float) -> str:
    """A value and its standard deviation, to the first digit of the latter."""
    if not isfinite(error) or error <= 0.0:
        return f"{value:.3g}"
    digits = max(0, -floor(log10(error)))
    return f"{round(value, digits) + 0.0:.{digits}f} ± {error:.{digits}f}"
