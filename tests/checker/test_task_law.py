"""The law of tasks before the tip's: each kind against pinocchio, and what is let pass."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.checker.test_run_laws import ARM, DT, JOINT, ROBOT, run

from ftqp.checker.checked_run import verdict
from ftqp.checker.claim_laws import task_errors
from ftqp.checker.trace import PHYSICS, HeldTask

AT_ZERO = ROBOT.pose(np.zeros(ROBOT.nv), ROBOT.joints[JOINT])
STILL = run(amplitude=0.0)


def held(away, rows=("x", "y"), **more):
    """A point behind a joint that is to be away from where the still run has it."""
    target = ROBOT.pose(STILL.q[0], ROBOT.joints[JOINT])[:3, 3] + away
    known = {"name": "elbow", "kind": "position", "rows": rows, "joint": JOINT, "at_zero": AT_ZERO}
    return HeldTask(**{**known, "target": target, **more})


def pushed(first, last, amount=0.05):
    """The still run with a joint pushed aside for some ticks."""
    q = STILL.q.copy()
    q[first:last, 0] += amount
    return replace(STILL, q=q)


def test_every_kind_is_what_pinocchio_says():
    rng, frame = np.random.default_rng(4), ROBOT.joints[JOINT]
    q = ROBOT.neutral + 0.3 * rng.normal(size=(5, ROBOT.nv))
    T = np.array([ROBOT.pose(one, frame) for one in q])
    tip_at_zero, tips = ROBOT.pose(np.zeros(ROBOT.nv)), np.array([ROBOT.pose(one) for one in q])
    goal = pin.SE3.Random().homogeneous
    axis, place = np.array([0.0, 0.6, 0.8]), np.array([0.4, 0.1, 0.3])
    turned = [pin.log3(goal[:3, :3] @ one[:3, :3].T)[[0, 2]] for one in T]
    position, rotation = task_errors(ARM, q, held(0.0, ("z", "rx", "rz"), kind="pose", target=goal))
    np.testing.assert_allclose(position, np.abs(goal[2, 3] - T[:, 2, 3]), atol=1e-12)
    np.testing.assert_allclose(rotation, np.linalg.norm(turned, axis=1), atol=1e-9)
    relative = held(0.0, ("x", "y", "z"), kind="relative", target=goal, other=6, other_at_zero=tip_at_zero)
    np.testing.assert_allclose(
        task_errors(ARM, q, relative)[0],
        np.linalg.norm((tips @ goal)[:, :3, 3] - T[:, :3, 3], axis=1), atol=1e-12,
    )  # fmt: skip
    mass = held(0.0, ("x",), kind="centre_of_mass", target=place)
    centres = [pin.centerOfMass(ROBOT.model, ROBOT.model.createData(), one)[0] for one in q]
    np.testing.assert_allclose(task_errors(ARM, q, mass)[0], np.abs(0.4 - np.array(centres)), atol=1e-12)
    for more, wished in (
        ({"target": place}, np.tile(place, (5, 1))),
        ({"target": place, "towards": True}, place - T[:, :3, 3]),
        ({"target": place, "towards": True, "other": 6, "other_at_zero": tip_at_zero}, (tips - T)[:, :3, 3]),
    ):
        cosine = np.sum(T[:, :3, :3] @ axis * wished, axis=1) / np.linalg.norm(wished, axis=1)
        none, angle = task_errors(ARM, q, held(0.0, kind="axis", axis=axis, **more))
        np.testing.assert_allclose(angle, np.arccos(cosine), atol=1e-9)
        assert not none.any()


def test_a_kept_task_is_let_pass_and_one_that_is_left_under_ok_is_found():
    kept = held([0.0, 0.009, 7.0])  # within the tolerance of the tip's task, and z does not count
    near = replace(STILL, tolerance=(0.01, 0.05), held=[kept])
    assert "tasks" not in verdict(ARM, near).laws
    left = replace(pushed(50, 60), tolerance=(0.01, 0.05), held=[kept])
    (breach,) = [one for one in verdict(ARM, left).breaches if one.law == "tasks"]
    assert (breach.tick, breach.ticks, breach.joint) == (50, 10, "") and breach.size > 0.1
    said = ["RELAXED" if 50 <= k < 60 else "OK" for k in range(len(left.status))]
    assert "tasks" not in verdict(ARM, replace(left, status=said)).laws


@pytest.mark.parametrize(("ticks", "laws"), [(8, set()), (20, {"tasks"})])
def test_a_claim_may_be_wrong_for_the_grace_of_physics(ticks, laws):
    left = replace(pushed(50, 50 + ticks, 0.3), tolerance=(0.01, 0.05), held=[held(0.0)])
    assert PHYSICS.grace == pytest.approx(10 * DT)
    assert verdict(ARM, left, PHYSICS).laws & {"tasks"} == laws


def test_a_task_that_begins_far_away_is_judged_from_when_it_arrived():
    far = held([0.0, 0.02, 0.0])
    run_in = STILL.q.copy()
    assert "tasks" not in verdict(ARM, replace(STILL, tolerance=(0.01, 0.05), held=[far])).laws
    reach = ROBOT.pose(STILL.q[0], ROBOT.joints[JOINT])[0, 3]
    run_in[100:200, 0] += 0.02 / reach  # it arrives, and leaves again
    assert task_errors(ARM, run_in[[150]], far)[0][0] < 0.01 < task_errors(ARM, run_in[[99]], far)[0][0]
    back = replace(STILL, q=run_in, tolerance=(0.01, 0.05), held=[far])
    (breach,) = [one for one in verdict(ARM, back).breaches if one.law == "tasks"]
    assert breach.tick == 200
