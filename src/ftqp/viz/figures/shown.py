"""Figures as pictures in memory, for ``log.plot()``, ``result.plot()`` and ``robot.show()``."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, unknown
from ftqp.core.picture import Picture
from ftqp.model.chain import frame_id
from ftqp.model.posture import places
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures.arm_picture import draw_arm
from ftqp.viz.figures.run_figures import drawings_of

UP = np.array([0.0, 0.0, 1.0])
"""What is up where there is no gravity."""


def run_picture(log: Log, figure: str = "path") -> Picture:
    """One of the figures of a run."""
    if not len(log):
        raise InputError(f"log {log.title} has no rows, expected at least one to draw")
    drawings = {name.removesuffix(".png"): draw for name, draw in drawings_of(log).items()}
    if figure not in drawings:
        raise unknown("figure", figure, "this run", list(drawings))
    return _kept(lambda file: drawings[figure](log, file), f"{figure} of {log.title}")


def robot_picture(robot: Robot, q: Any = None) -> Picture:
    """An arm at a posture, (nv,) or (nq,) [rad or m]; at its neutral one without."""
    posture = robot.neutral if q is None else robot.angles(q)
    title = f"{robot.name}, tip {robot.tip}"
    return _kept(lambda file: robot_figure(file, title, robot, posture), title)


def robot_figure(path: str | Path, title: str, robot: Robot, q: FloatArray) -> Path:
    """Draw a robot in the configuration q, (nv,) [rad or m], to a PNG file."""
    points, axes = places(robot.model, frame_id(robot.model, robot.tip), robot.configuration(q))
    gravity = np.array(robot.chain.gravity)
    up = -gravity / np.linalg.norm(gravity) if gravity.any() else UP
    ranges = np.column_stack([robot.limits.q_min, robot.limits.q_max])
    return draw_arm(path, title, robot.joints, points, axes, up, ranges, q, robot.chain.limbs)


def _kept(draw: Callable[[Path], Path], title: str) -> Picture:
    """What is drawn to a file, in memory."""
    with TemporaryDirectory(prefix="ftqp-") as folder:
        return Picture(draw(Path(folder) / "picture.png").read_bytes(), title)
