"""What a detector knows of healthy motion, in a file."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self, final

import numpy as np

from ftqp.core.checks import FloatArray, array, as_number, read_only
from ftqp.core.errors import InputError, reading

FORMAT = 1
"""Version of the file."""
AGAIN = "make a new one from runs of the healthy arm, `ftqp calibrate RUN --out FILE` or detector.calibrate"
"""The remedy for a file that is none."""


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
        viscous: Viscous friction of each joint on top of the model's [N m s/rad or N s/m].
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
        with reading(path, "a calibration", AGAIN):
            found = json.loads(Path(path).read_text(encoding="utf-8"))
            if found.get("format") != FORMAT:
                raise InputError(f"{path} is no calibration of format {FORMAT}; {AGAIN}")
            n = len(found["joints"])
            return cls(
                joints=tuple(map(str, found["joints"])),
                drive=str(found["drive"]),
                coulomb=array("coulomb of the calibration", found["coulomb"], (n,)),
                viscous=array("viscous of the calibration", found["viscous"], (n,)),
                **{key: as_number(key, found[key]) for key in ("dt", "sigma", "quantum", "hours")},
            )
