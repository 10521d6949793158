"""Planar arms of the literature and closed forms of their solutions, for the tests of studies."""

import numpy as np

from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.model import catalog
from ftqp.model.limits import JointLimits
from ftqp.model.robot import Robot
from ftqp.model.serial import Body, placement, serial_model


def links(*lengths):
    """A planar arm whose joints turn without end."""
    return catalog.load("planar", lengths=lengths, continuous=True)


UNIT = links(1, 1, 1)
"""Three links, which follow a line from where they are so."""
Q0 = np.array([-1.524418, 1.260809, 0.741032])
START = UNIT.pose(Q0)
PATH = Line(START, np.array([0.5, 1.2, 0.0]) - START[:3, 3], duration=10.0)
TASK = task_path(UNIT, PATH, dt=0.1, rows="position")


def survives(q, k):
    """Which locks unit links survive at sample k of their line, for postures (n, 3): a closed form, (n, 3).

    It is the distance that is left for the other two links.
    """
    goals = TASK.goals[k:, :2, 3]
    first = np.linalg.norm(
        goals[None] - np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=1)[:, None], axis=2
    )
    found = [(first < 2.0).all(axis=1)]
    away = np.linalg.norm(goals, axis=1)
    for joint in (1, 2):
        A = np.sqrt(2.0 + 2.0 * np.cos(q[:, joint]))[:, None]
        found.append(((np.abs(A - 1.0) < away) & (away < A + 1.0)).all(axis=1))
    return np.stack(found, axis=1)


def closed_form_ends(lengths, x):
    """Values of each joint of three at which the other two are stretched or folded, tip at x [rad].

    Source: goel2005, from the law of cosines with the tip at the distance R.
    """
    l1, l2, l3 = lengths
    R, toward = float(np.hypot(*x)), float(np.arctan2(x[1], x[0]))
    ends = [[], [], []]
    for s in (1.0, -1.0):
        cosines = (
            (l1**2 + R**2 - (l2 + s * l3) ** 2) / (2.0 * l1 * R),
            ((R - s * l3) ** 2 - l1**2 - l2**2) / (2.0 * l1 * l2),
            ((R - s * l1) ** 2 - l2**2 - l3**2) / (2.0 * l2 * l3),
        )
        for i, cosine in enumerate(cosines):
            if abs(cosine) <= 1.0:
                middle = toward if i == 0 else 0.0
                ends[i] += [middle + np.arccos(cosine), middle - np.arccos(cosine)]
    return ends


def telescope():
    """A planar arm that turns, slides between 0.2 and 1.5 m and turns a link of 0.5 m."""
    bodies = [
        Body(name="turn", placement=placement((0.0, 0.0, 0.0))),
        Body(name="slide", placement=placement((0.0, 0.0, 0.0), (0.0, np.pi / 2, 0.0)), prismatic=True),
        Body(name="hand", placement=placement((0.0, 0.0, 0.0), (0.0, -np.pi / 2, 0.0))),
    ]
    limits = JointLimits.of(3, q_min=[-np.inf, 0.2, -3.0], q_max=[np.inf, 1.5, 3.0], v_max=1.0)
    model = serial_model("telescope", bodies, limits, frames=[("tip", placement((0.5, 0.0, 0.0)))])
    return Robot.from_pinocchio(model, "tip", limits=limits, default_rows=("x", "y"), kinematics_only=True)
