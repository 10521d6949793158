"""What a detector knows of healthy motion, in a file."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self, final

import numpy as np

from ftqp.core.checks import FloatArray, array, is_number, read_only
from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import Residual

FORMAT = 1
"""Version of the file."""
LARGEST_FILE = 10_000_000
"""Bytes that are read at most."""
LARGEST = 1e9
"""No figure of a calibration is larger [-]. A convention: far beyond any, and far below where squares
overflow."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """How large the residuals of a healthy arm are; another drive, tool or delay asks for a new one.

    Attributes:
        joints: The joints' names.
        drive: What the arm takes.
        dt: The sampling period [s].
        bandwidths: Of the slow and the fast observer [1/s].
        delay: How late the samples were, in ticks.
        room: Thresholds T of every residual and joint, (9, nv), rows as in ``Residual``; infinite where the
            log had no such residual.
        sigma: Noise of the positions in the log [rad or m].
        quantum: Smallest step of the positions, 0 where there is none [rad or m].
        coulomb: Coulomb friction of each joint [N m or N].
        viscous: Viscous friction of each joint beside the model's [N m s/rad or N s/m].
        hours: Length of the healthy motion [h].
        rate: False alarms an hour for which the thresholds were set.
        alarms: False alarms on the parts of the log that the thresholds, made from the others, had not seen.
        rate_low: Lower end of the 95 % interval of the rate that these alarms show [1/h].
        rate_high: Upper end [1/h].
        extrapolated: Whether ``rate`` is below what the log's length shows.
    """

    joints: tuple[str, ...]
    drive: str
    dt: float
    bandwidths: tuple[float, float]
    delay: int
    room: FloatArray
    sigma: float
    quantum: float
    coulomb: FloatArray
    viscous: FloatArray
    hours: float
    rate: float
    alarms: int
    rate_low: float
    rate_high: float
    extrapolated: bool

    def __post_init__(self) -> None:
        read_only(self)

    def __str__(self) -> str:
        """The claim in one sentence."""
        claim = (
            f"Thresholds for {self.rate:g} false alarms an hour from {self.hours:.3g} h of healthy motion; "
            f"{self.alarms} alarms on unseen parts: between {self.rate_low:.2g} and {self.rate_high:.2g} an "
            "hour (95 %)."
        )
        return claim + (" The rate is extrapolated." if self.extrapolated else "")

    def refuse_others(
        self, joints: tuple[str, ...], drive: str, dt: float, bandwidths: tuple[float, float], delay: int
    ) -> None:
        """Refuse a detector of another arm, drive or timing.

        Args:
            joints: Names of its joints.
            drive: What its arm takes.
            dt: Its sampling period [s].
            bandwidths: Of its observers [1/s].
            delay: How late its samples are, in ticks.

        Raises:
            InputError: One of them differs.
        """
        own = (joints, drive, dt, bandwidths, delay)
        its = (self.joints, self.drive, self.dt, self.bandwidths, self.delay)
        names = ("joints", "drive", "dt", "bandwidths", "delay in ticks")
        for name, here, there in zip(names, own, its, strict=True):
            if here != there:
                raise InputError(
                    f"the calibration was made with {name} {there}, but this detector has {here}; "
                    "calibrate anew on healthy motion of this arm"
                )

    def save(self, path: str | Path) -> None:
        """Write it as JSON.

        Args:
            path: The file; one that exists is replaced.
        """
        content: dict[str, Any] = {"format": FORMAT, **asdict(self)}
        for key, value in content.items():
            if isinstance(value, np.ndarray):
                content[key] = np.where(np.isfinite(value), value, -1.0).tolist()
        content["residuals"] = [kind.name.lower() for kind in Residual]
        Path(path).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what ``save`` wrote.

        Args:
            path: The file.

        Raises:
            InputError: The file cannot be read, or is no calibration of this version.
        """
        file = Path(path)
        if file.exists() and not (file.is_file() and file.stat().st_size <= LARGEST_FILE):
            raise InputError(
                f"{path} is no calibration, but a folder, a device or a file of more than "
                f"{LARGEST_FILE / 1e6:.0f} MB; name the file that calibration.save(file) wrote"
            )
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(
                f"{path} cannot be read as a calibration: {reason}; make one with "
                "detector.calibrate(log).calibration.save(file)"
            ) from error
        names = {field.name for field in fields(cls)}
        if not isinstance(content, dict) or content.get("format") != FORMAT or not names <= content.keys():
            raise InputError(
                f"{path} is no calibration of format {FORMAT}; make a new one from runs of the healthy arm, "
                "`ftqp calibrate RUN --out FILE` or ftqp.Detector.calibrate"
            )
        values = {name: content[name] for name in names}
        _refuse_strange(path, values)
        n = len(values["joints"])
        room = array("room of the calibration", values["room"], (len(Residual), n))
        return cls(
            **values
            | {
                "joints": tuple(values["joints"]),
                "bandwidths": tuple(values["bandwidths"]),
                "room": np.where(room < 0.0, np.inf, room),
                "coulomb": array("coulomb of the calibration", values["coulomb"], (n,)),
                "viscous": array("viscous of the calibration", values["viscous"], (n,)),
            }
        )


def _refuse_strange(path: str | Path, values: Mapping[str, Any]) -> None:
    """Refuse what is of another kind than a calibration has; its arrays are looked at where they are made."""
    for field in fields(Calibration):
        value = values[field.name]
        if field.name == "joints":
            good = isinstance(value, list) and all(isinstance(name, str) for name in value)
        elif field.name == "bandwidths":
            good = (
                isinstance(value, list)
                and len(value) == 2
                and all(is_number(x, LARGEST) and x > 0 for x in value)
            )
        elif field.type in (str, bool):
            good = type(value) is field.type
        elif field.type in (int, float):
            good = is_number(value, LARGEST) and (field.type is float or isinstance(value, int))
        else:
            good = True
        if not good:
            raise InputError(
                f"{path} is no calibration: its {field.name} is {value!r:.60}; make a new one with "
                "ftqp.Detector.calibrate"
            )
