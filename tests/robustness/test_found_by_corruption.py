"""What ten million corrupted steps found, made smaller."""

import numpy as np
import pytest

import ftqp

DT = 0.01


@pytest.mark.parametrize("fault", [ftqp.Locked(1), ftqp.FreeSwinging(1)])
def test_sensor_that_lies_about_a_failed_joint_makes_no_torque_infinite(fault):
    """It is said to be where it was believed to be, a glitch once aside: what is believed runs away."""
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, DT, level="velocity", drive=ftqp.Drive(kind="torque", latency=DT))
    q = panda.neutral.copy()
    pose = panda.pose(q).copy()
    pose[:3, 3] += (0.1, 0.3, -0.2)
    target = ftqp.Target(pose=pose)
    planner.reset(q)
    late = [q, q]
    for k in range(300):
        if k == 10:
            planner.report(fault)
        place = late[-2].copy()
        if k == 15:
            place[1] -= 0.015
        step = planner.step(place, None, target)
        assert np.isfinite(step.tau).all() and np.isfinite(step.q).all(), k
        late.append(step.reference.q.copy())


def test_certificate_of_a_step_that_was_kept_is_of_its_own_rows():
    """An arm that cannot turn its tool gives a row up; after a reset it is asked for again."""
    panda = ftqp.robots.load("panda")
    q, v, limits = panda.neutral.copy(), np.zeros(7), panda.limits
    narrow = panda.with_limits(
        q_min=np.maximum(limits.q_min, q - 0.3), q_max=np.minimum(limits.q_max, q + 0.3)
    )
    task = ftqp.Task(degrade=("pose", "position_axis"))
    planner = ftqp.Planner(narrow, 2e-3, task=task, emergency=None)
    planner.reset(q)
    pose = panda.pose(q).copy()
    c, s = np.cos(1.2), np.sin(1.2)
    pose[:3, :3] = pose[:3, :3] @ [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    target = ftqp.Target(pose=pose)
    for _ in range(1000):
        step = planner.step(q, v, target)
        q, v = step.reference.q.copy(), step.reference.v.copy()
    kept, said = step.copy(), str(step.certificate)
    assert len(kept.slack) == 5, "this case is to give a row up"
    planner.reset(q, v)
    assert len(planner.step(q, v, target).slack) == 6
    assert str(kept.certificate) == said


def test_error_while_samples_are_late_is_not_one_of_long_ago_after_targets_that_were_refused():
    """The tip has been led away from where it rests at first; then targets are broken for some ticks."""
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, 2e-3, level="velocity", drive=ftqp.Drive(latency=6e-3))
    q = panda.neutral.copy()
    planner.reset(q)
    here = panda.pose(q)
    far = here.copy()
    far[:3, 3] += (0.0, 0.3, 0.0)
    late = [q] * 4
    errors = []
    for k in range(60):
        pose = here if k < 20 else far
        if 22 <= k < 30:
            pose = np.full((4, 4), np.nan)
        step = planner.step(late[-4], None, ftqp.Target(pose=pose))
        late.append(step.q.copy())
        errors.append(step.position_error)
        if k >= 30:
            assert step.status is not ftqp.StepStatus.OK, k
    assert min(errors[30:]) > 0.1
