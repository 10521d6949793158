"""The names of a planner's QP fit the QP that its external solvers get."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.labels import row_labels, variable_labels
from ftqp.qp import Recorder

SLACKS = tuple(f"slack {row}" for row in ("x", "y", "z"))
EXTRA = {"hard": (), "slack": SLACKS, "lexicographic": SLACKS, "scaled": ("scale", *SLACKS)}


@pytest.mark.parametrize("mode", EXTRA)
@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("name", ["panda", "srs7"])
def test_every_variable_and_row_has_a_name(name, keeps, mode):
    robot = ftqp.robots.load(name)
    recorder = Recorder("active_set")
    kept = [ftqp.Keep(robot.tip, above=(0.0, 0.0, -5.0), name="floor")] if keeps else None
    task = ftqp.Task(rows="position", mode=mode)
    planner = ftqp.Planner(robot, 2e-3, task=task, backend=recorder, constraints=kept)
    planner.reset(robot.neutral)
    planner.step(robot.neutral, np.zeros(7), ftqp.Target(pose=robot.pose(robot.neutral)))
    variables, rows = variable_labels(planner), row_labels(planner)
    recording = recorder.recording(dt=2e-3, variables=variables, rows=rows)
    assert recording.variables == (*robot.joints, *EXTRA[mode])
    torques = tuple(f"torque {joint}" for joint in robot.joints)
    rows_of_C = (torques if name == "panda" else ()) + (("keep floor",) if keeps else ())
    assert recording.rows == ("x", "y", "z", *rows_of_C)


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
