"""Figures of one run: arm, path and error, joints, velocities, torques, statuses."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ftqp.core.errors import InputError, unknown
from ftqp.core.picture import Picture
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import is_sensed
from ftqp.sim.log.signals import refuse_unknown_conditions
from ftqp.viz.figures import error_figures as errors
from ftqp.viz.figures import joint_figures as joints
from ftqp.viz.figures import status_ribbon as ribbon
from ftqp.viz.figures.canvas import made_folder, picture_of

DRAWINGS = {
    "path.png": errors.draw_path,
    "tasks.png": errors.draw_further,
    "joints.png": joints.draw_positions,
    "velocities.png": joints.draw_velocities,
    "following.png": joints.draw_following,
    "torques.png": joints.draw_torques,
    "status.png": ribbon.draw,
    "base.png": errors.draw_base,
}
"""The figures of a run by file name."""


def save_figures(log: Log, folder: str | Path) -> list[Path]:
    """Draw all figures of a run as PNG files into ``folder``, which is made if it is missing.

    Existing files of the same names are replaced. The order is path, tasks (of a planner with soft tasks or
    kept points), joints, velocities, following (of an arm with a drive or sensors), torques (of an arm with
    inertia), status, base (of a run on a moving base).
    """
    if not len(log):
        raise InputError(f"log {log.path} has no rows, expected at least one to draw")
    for name in ("truth", "belief"):
        refuse_unknown_conditions(log[name], log.title)
    place = made_folder(folder)
    return [draw(log, place / name) for name, draw in drawings_of(log).items()]


def drawings_of(log: Log) -> dict[str, Callable[[Log, Path], Path]]:
    """The figures that a run has, by file name."""
    absent = {"following.png": not is_sensed(log), "base.png": "base_status" not in log}
    absent["tasks.png"] = not errors.further_panels(log)
    absent["torques.png"] = not np.isfinite(log["tau"]).any()
    return {name: draw for name, draw in DRAWINGS.items() if not absent.get(name, False)}


def run_picture(log: Log, figure: str = "path") -> Picture:
    """One of the figures of a run."""
    if not len(log):
        raise InputError(f"log {log.title} has no rows, expected at least one to draw")
    drawings = {name.removesuffix(".png"): draw for name, draw in drawings_of(log).items()}
    if figure not in drawings:
        raise unknown("figure", figure, "this run", list(drawings))
    return picture_of(lambda file: drawings[figure](log, file), f"{figure} of {log.title}")
