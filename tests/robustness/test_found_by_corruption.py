"""What ten million corrupted steps found, made smaller; poses that are transposed."""

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


PANDA = ftqp.robots.load("panda")
POSE = PANDA.pose(PANDA.neutral)
SKEWED = POSE.copy()
SKEWED[3] = (0.0, 0.0, 0.1, 1.0)
SCALED = POSE.copy()
SCALED[3, 3] = 2.0
WRONG = {"transposed": POSE.T, "another last row": SKEWED, "another scale": SCALED}
MADE = {
    "target": lambda T: ftqp.Target(pose=T),
    "targets": lambda T: ftqp.Targets(np.array([POSE, T, POSE])),
    "goto": lambda T: ftqp.GoTo(started(), pose=T),
    "line": lambda T: ftqp.paths.Line(T, displacement=[0.1, 0, 0], duration=1.0),
    "hold": lambda T: ftqp.paths.Hold(T, duration=1.0),
    "circle": lambda T: ftqp.paths.Circle(T, radius=0.1, duration=1.0),
    "postures": lambda T: ftqp.postures(PANDA, T),
    "tip": lambda T: PANDA.with_tip(T),
    "box": lambda T: ftqp.Box(size=(0.1, 0.1, 0.1), place=T),
}


def started(**more):
    planner = ftqp.Planner(PANDA, **more)
    planner.reset(PANDA.neutral)
    return planner


@pytest.mark.parametrize("make", list(MADE.values()), ids=list(MADE))
@pytest.mark.parametrize("T", list(WRONG.values()), ids=list(WRONG))
def test_nothing_is_made_of_what_is_no_pose(make, T):
    with pytest.raises(ftqp.InputError, match=r"last row .*expected the last row 0 0 0 1.*\.T"):
        make(T)
    make(POSE)


@pytest.mark.parametrize("T", list(WRONG.values()), ids=list(WRONG))
@pytest.mark.parametrize("how", ["at", "written", "pose"])
def test_a_target_that_becomes_none_in_a_loop_is_an_invalid_input_and_moves_nothing(T, how):
    planner, target = started(), ftqp.Target(pose=POSE)
    assert planner.step(PANDA.neutral, None, target).status.name == "OK"
    if how == "at":
        target.at(np.ascontiguousarray(T))
    elif how == "written":
        target.pose[:] = T
    else:
        target.pose = T
    q = PANDA.neutral.copy()
    for _ in range(50):
        step = planner.step(q, None, target)
        assert step.status.name == "INVALID_INPUT"
        q = step.q.copy()
    np.testing.assert_allclose(q, PANDA.neutral, atol=1e-6)
    assert planner.step(q, None, target.at(POSE)).status.name == "OK"


def test_a_measured_tip_that_is_transposed_counts_as_not_measured():
    planner, target = started(), ftqp.Target(pose=POSE)
    plain = started()
    for k in range(10):
        step = planner.step(PANDA.neutral, None, target, tip=POSE.T if k % 3 == 0 else POSE)
        want = plain.step(PANDA.neutral, None, target, tip=POSE)
        np.testing.assert_allclose(step.q, want.q, atol=1e-9)
