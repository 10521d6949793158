"""The names of a planner's QP fit the QP that its external solvers get."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.labels import row_labels, variable_labels
from ftqp.kernel.layout.rows import ROW_KINDS
from ftqp.qp import Recorder

SLACKS = tuple(f"slack {row}" for row in ("x", "y", "z"))
EXTRA = {"hard": (), "slack": SLACKS, "lexicographic": SLACKS, "scaled": ("scale", *SLACKS)}


@pytest.mark.parametrize("mode", EXTRA)
@pytest.mark.parametrize("name", ["panda", "srs7"])
def test_every_variable_and_row_has_a_name(name, mode):
    robot = ftqp.robots.load(name)
    recorder = Recorder("active_set")
    planner = ftqp.Planner(robot, 2e-3, task=ftqp.Task(rows="position", mode=mode), backend=recorder)
    planner.reset(robot.neutral)
    planner.step(robot.neutral, np.zeros(7), ftqp.Target(pose=robot.pose(robot.neutral)))
    variables, rows = variable_labels(planner), row_labels(planner)
    recording = recorder.recording(dt=2e-3, variables=variables, rows=rows)
    assert recording.variables == (*robot.joints, *EXTRA[mode])
    torques = tuple(f"torque {joint}" for joint in robot.joints)
    others = tuple(label for kind in ROW_KINDS[1:] if name == "panda" or not kind.needs_inertia
                   for label in map(kind.label, robot.joints))  # fmt: skip
    assert recording.rows == ("x", "y", "z", *(torques if name == "panda" else ()), *others)


def test_rows_come_in_the_order_of_the_pose():
    planner = ftqp.Planner(ftqp.robots.load("srs7"), task=ftqp.Task(rows=("rz", "x"), mode="hard"))
    assert row_labels(planner)[:2] == ("x", "rz")


def test_planner_counts_its_steps_from_zero(planar6):
    planner = ftqp.Planner(planar6, 0.01)
    target = ftqp.Target(pose=planar6.pose(planar6.neutral))
    assert planner.tick == -1
    for _ in range(2):
        planner.reset(planar6.neutral)
        for k in range(3):
            planner.step(planar6.neutral, np.zeros(6), target)
            assert planner.tick == k
