"""The law of axes in a cone: what it lets pass and what it finds."""

from dataclasses import replace

import numpy as np
import pytest
from tests.checker.test_run_laws import ARM, JOINT, ROBOT, run

from ftqp.checker.checked_run import verdict
from ftqp.checker.trace import Cone, Failure


def cone(room):
    """A cone that an axis behind a joint keeps an angle from in the sound run, at the nearest."""
    at_zero, axis = ROBOT.pose(np.zeros(ROBOT.nv), ROBOT.joints[JOINT]), np.array([0.6, 0.0, 0.8])
    axes = [ROBOT.pose(q, ROBOT.joints[JOINT])[:3, :3] @ axis for q in run().q]
    along = np.array([0.1, 0.2, 1.0]) / np.linalg.norm([0.1, 0.2, 1.0])
    return Cone(
        joint=JOINT, at_zero=at_zero[:3, 3].tolist(), axis_at_zero=(at_zero[:3, :3] @ axis).tolist(),
        along=along.tolist(), within=float(np.arccos(axes @ along).max()) + room,
    )  # fmt: skip


def test_axis_in_its_cone_is_let_pass_and_one_outside_is_found():
    assert verdict(ARM, run(cones=[cone(0.0), cone(0.1)])).laws == set()
    (breach,) = verdict(ARM, run(cones=[cone(0.1), cone(-0.001)])).breaches
    assert breach.law == "cone" and breach.joint == ROBOT.joints[JOINT]
    assert breach.size == pytest.approx(0.001 - 2e-5, abs=1e-6)
    assert "an axis that it moves is outside its cone" in str(breach)


def test_axis_that_begins_outside_may_stay_and_one_that_swings_freely_is_excused():
    still = run()
    still = replace(still, cones=[replace(cone(0.0), within=0.01)], q=np.tile(still.q[:1], (len(still.q), 1)))
    assert "cone" not in verdict(ARM, still).laws
    free = Failure(joint=JOINT, kind="free", since=0.0, told=0.0)
    assert "cone" not in verdict(ARM, run(cones=[cone(-0.001)], failures=[free])).laws
