"""The motion in the log of a run, for a calibration."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ftqp.core.errors import InputError
from ftqp.faults.detection.motion_log import MotionLog

DIGITS = 12
"""Of sampling periods that are compared."""


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
    """What a detector would have been given in a healthy run.

    Raises:
        InputError: It is a run of another arm, drive or period, a joint fails or is believed to, or it does
            not keep what was measured and referred to.
    """
    about, first = log.metadata, joints[0]
    of = (
        ("joints", tuple(about.get("joints", ())), joints),
        ("dt", round(float(about.get("dt", np.nan)), DIGITS), round(dt, DIGITS)),
        ("drive", about.get("drive") or drive, drive),  # without one it does exactly what it is told
    )
    for name, its, own in of:
        if its != own:
            raise InputError(f"{log.title} has {name} {its}, but the detector has {own}; record such a run")
    if f"q_reference.{first}" not in log:
        raise InputError(
            f"{log.title} does not keep the planner's reference beside what was measured; record the run "
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
