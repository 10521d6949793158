"""How far a plan's postures may be off."""

import numpy as np
import pytest
from planar_arms import TASK, survives
from planar_arms import UNIT as ARM

from ftqp.analysis.planning.fault_plan import plan_of
from ftqp.analysis.planning.plan_case import PlanSettings
from ftqp.analysis.planning.planned import plan
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.model import catalog


def test_corridor_ends_where_the_closed_form_says_that_a_joint_is_lost() -> None:
    made = plan(ARM, TASK, settings=PlanSettings(waypoints=25, spacing=0.2))
    corridor = made.corridor(stride=10, widest=3.0, spacing=0.02)
    assert (corridor.low > 0.0).all() and (corridor.high > 0.0).all()
    ended = 0
    for row, k in enumerate(corridor.samples):
        for reach, q, side in (
            (corridor.low, corridor.q_low, -1.0),
            (corridor.high, corridor.q_high, 1.0),
        ):
            assert np.abs(ARM.pose(q[row])[:2, 3] - TASK.goals[k, :2, 3]).max() < 1e-9
            assert survives(q[row][None], k).all()
            if reach[row] < 2.9:
                s2, s3, s23 = np.sin(q[row, 1]), np.sin(q[row, 2]), np.sin(q[row, 1] + q[row, 2])
                n = np.array([s3, -(s3 + s23), s2 + s23])
                beyond = q[row] + side * 0.03 * n / np.linalg.norm(n)
                ended += not survives(beyond[None], k).all()
    assert ended >= 5


def test_corridor_of_an_arm_with_two_joints_to_spare_is_refused() -> None:
    arm = catalog.load("planar", count=4)
    task = task_path(
        arm, Line(arm.pose(arm.neutral), (-0.1, 0.0, 0.0), duration=1.0), dt=0.1, rows="position"
    )
    made = plan_of(
        task, np.tile(arm.neutral, (task.N + 1, 1)), coverage=0.0, stride=4, method="dp", settings={}
    )
    with pytest.raises(InputError, match="2 joints to spare"):
        made.corridor()
