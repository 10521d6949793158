"""A Panda as the checker reads it, and runs of it that are made by hand."""

import numpy as np

from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import Trace
from ftqp.model import catalog

ROBOT = catalog.load("panda")
ARM = ModelFile.read(ROBOT.to_urdf(), ROBOT.tip)


def trace_of(q, v, dt, **changes):
    """A run that goes as it is sent, (K + 1, nv), and says RELAXED of a target that asks for nothing."""
    ticks = len(q) - 1
    made = dict(
        dt=dt, level="acceleration", q=q, v=v, sent_q=q[1:].copy(), sent_v=v[1:].copy(),
        status=["RELAXED"] * ticks, target=np.tile(np.eye(4), (ticks, 1, 1)), rows=("x", "y", "z"),
        tolerance=(1.0, 1.0),
    )  # fmt: skip
    return Trace(**(made | changes))


def places_of(v, dt):
    """Where these speeds lead from neutral, (K + 1, nv)."""
    return ROBOT.neutral + np.vstack([0.0 * ROBOT.neutral, np.cumsum(0.5 * dt * (v[1:] + v[:-1]), axis=0)])
