"""What was sent to an arm and what was measured of it, tick by tick."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, Protocol, final, runtime_checkable

import numpy as np

from ftqp.core.checks import FloatArray, frozen, numbers
from ftqp.core.errors import InputError

DIGITS = 12
"""Of sampling periods that are compared."""


class Commanded(NamedTuple):
    """What the arm was sent in one tick, in place of a planner's step.

    Attributes:
        q: Reference at the end of the tick, (nv,) [rad or m].
        v: Its velocity, (nv,) [rad/s or m/s].
        a: Its acceleration during the tick, (nv,) [rad/s2 or m/s2].
        tau: Torques sent to an arm that takes torques, (nv,) [N m or N]; None of another one.
        demand: Torques that the drive of another arm asked of its motors when the samples of this tick were
            taken, (nv,); None where they are unknown.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray | None = None
    demand: FloatArray | None = None


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionLog:
    """One recorded motion, as a detector would have been given it.

    Attributes:
        q: Measured positions, (K, nv) [rad or m].
        q_ref: The reference at the end of each tick, ``step.reference.q``, (K, nv).
        v_ref: Its velocity, (K, nv) [rad/s or m/s].
        a_ref: Its acceleration during the tick, (K, nv) [rad/s2 or m/s2].
        tau: Measured torques, (K, nv) [N m or N]; None where there are none.
        effort: What the motors were asked for: the torques sent in each tick to an arm that takes torques, or
            what the drive of another one asked for when samples were taken, (K, nv); None if unknown.

    Raises:
        InputError: The arrays differ in shape, or are no numbers.
    """

    q: FloatArray
    q_ref: FloatArray
    v_ref: FloatArray
    a_ref: FloatArray
    tau: FloatArray | None = None
    effort: FloatArray | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.q)
        for field in fields(self):
            value = getattr(self, field.name)
            if value is None and field.name in ("tau", "effort"):
                continue
            object.__setattr__(self, field.name, _column(field.name, value, shape))

    def __len__(self) -> int:
        """The number of ticks."""
        return len(self.q)

    @property
    def nv(self) -> int:
        """The number of joints."""
        return int(self.q.shape[1])

    def columns(self) -> dict[str, FloatArray | None]:
        """The columns by their names."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def _column(name: str, value: Any, shape: tuple[int, ...]) -> FloatArray:
    """A read-only column of a log; NaN passes."""
    column = numbers(f"{name} of the log", value, "; expected shape (K, nv)")
    if column.ndim != 2 or column.shape != shape or not len(column):
        raise InputError(
            f"{name} of the log has shape {column.shape}, expected that of q, (K, nv) = {shape}"
            if len(shape) == 2 and shape[0]
            else f"q of the log has shape {shape}, expected (K, nv), one row a tick"
        )
    return frozen(column)


@runtime_checkable
class RecordedRun(Protocol):
    """The log of a run, such as ``ftqp.load_log`` gives: columns by name, and what the run was about."""

    @property
    def metadata(self) -> Mapping[str, Any]: ...
    @property
    def title(self) -> str: ...
    def __contains__(self, name: object) -> bool: ...
    def __getitem__(self, name: str) -> Any: ...


def motion_of(log: RecordedRun, joints: tuple[str, ...], dt: float, drive: str) -> MotionLog:
    """What a detector would have been given in a healthy run."""
    about, first = log.metadata, joints[0]
    of = (
        ("joints", tuple(about.get("joints", ())), joints),
        ("dt", round(float(about.get("dt", np.nan)), DIGITS), round(dt, DIGITS)),
        ("drive", about.get("drive") or drive, drive),  # without one it follows exactly
    )
    for name, its, own in of:
        if its != own:
            raise InputError(f"{log.title} has {name} {its}, but the detector has {own}; record such a run")
    if f"q_reference.{first}" not in log:
        raise InputError(
            f"{log.title} does not keep the planner's reference next to what was measured; record the run "
            "again, with sensors or plant 'mujoco'"
        )
    for whose in ("truth", "belief"):
        failed = np.argwhere(log[whose] != 0)
        if len(failed):
            row, joint = failed[0]
            raise InputError(
                f"{log.title} is not healthy: {joints[joint]} fails, or is believed to, at "
                f"{log['t'][row]:g} s; record a run without faults and without a detector"
            )
    effort = None
    if drive == "torque":
        effort = log["tau"]
    elif f"tau_demand.{first}" in log:
        effort = log["tau_demand"]
    return MotionLog(
        q=log["q_measured"],
        q_ref=log["q_reference"],
        v_ref=log["v_reference"],
        a_ref=log["a"],
        tau=log["tau_measured"] if f"tau_measured.{first}" in log else None,
        effort=effort,
    )
