"""What a detector knows of healthy motion, in a file."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self, final

import numpy as np

from ftqp.core.checks import FloatArray, array, is_number, read_only
from ftqp.core.errors import InputError

FORMAT = 1
"""Version of the file."""
LARGEST = 1e9
"""No figure of a calibration is larger [-]. A convention: far beyond any, and far below where squares
overflow."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """Noise and friction of a healthy arm, with which a monitor of torques begins.

    Attributes:
        joints: The joints' names.
        drive: What the arm took in the log.
        dt: The sampling period [s].
        sigma: Noise of the positions in the log [rad or m].
        quantum: Smallest step of the positions, 0 where there is none [rad or m].
        coulomb: Coulomb friction of each joint [N m or N].
        viscous: Viscous friction of each joint beside the model's [N m s/rad or N s/m].
        hours: Length of the healthy motion [h].
    """

    joints: tuple[str, ...]
    drive: str
    dt: float
    sigma: float
    quantum: float
    coulomb: FloatArray
    viscous: FloatArray
    hours: float

    def __post_init__(self) -> None:
        read_only(self)

    def __str__(self) -> str:
        """What was found, in one sentence."""
        rubs = int(np.count_nonzero(self.coulomb))
        return f"Friction of {rubs} of {len(self.joints)} joints from {self.hours:.3g} h of healthy motion."

    def refuse_others(self, joints: tuple[str, ...]) -> None:
        """Refuse another arm.

        Args:
            joints: Names of its joints.

        Raises:
            InputError: They differ.
        """
        if joints != self.joints:
            raise InputError(
                f"the calibration was made with joints {self.joints}, but this arm has {joints}; "
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
                content[key] = value.tolist()
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
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
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
        return cls(
            **values
            | {
                "joints": tuple(values["joints"]),
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
