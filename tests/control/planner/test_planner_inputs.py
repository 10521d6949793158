"""A step takes numbers in any form and whatever the world hands it; only a programmer's mistake raises."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

DT = 2e-3
GOOD = (ftqp.StepStatus.OK, ftqp.StepStatus.RELAXED)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"q": np.zeros(6)}, r"q has shape \(6,\), expected \(nv,\) = \(7,\)"),
        ({"q": [10**400] * 7}, r"q is not an array of numbers: \[1000000000"),
        ({"v": np.zeros(7, dtype="datetime64[s]")}, r"v is not an array of numbers: array\(\['1970"),
        ({"q": np.zeros((7, 1))}, r"q has shape \(7, 1\), expected a vector"),
        ({"q": None}, r"q has shape \(\), expected a vector"),
        ({"q": "home"}, "q is not an array of numbers: 'home'"),
        ({"v": np.zeros(8)}, r"v has shape \(8,\), expected \(nv,\) = \(7,\)"),
        ({"v": [0.1]}, r"v has shape \(1,\), expected \(nv,\) = \(7,\)"),
        ({"q": np.zeros(1)}, r"q has shape \(1,\), expected \(nv,\) = \(7,\)"),
        ({"v": np.zeros((1, 7))}, r"v has shape \(1, 7\), expected a vector"),
        ({"v": [0.0] * 6 + ["fast"]}, "v is not an array of numbers"),
        ({"v": 0.0}, r"v has shape \(\), expected a vector"),
        ({"target": np.eye(4)}, r"target is ndarray, expected ftqp\.Target"),
        ({"target": None}, r"step got no target; its second argument is the measured velocity"),
        ({"tau": np.zeros(6)}, r"tau has shape \(6,\), expected \(7,\)"),
        ({"tip": np.eye(3)}, r"tip has shape \(3, 3\), expected \(4, 4\)"),
        ({"_": 3}, r"step got 3 behind its target, expected nothing; give tau, tip and ticks by name"),
        ({"tip": "here"}, "tip is not an array of numbers: 'here'"),
        ({"tau": np.full(7, np.nan), "tip": np.eye(3)}, r"tip has shape \(3, 3\), expected \(4, 4\)"),
    ],
)
def test_programmers_mistake_raises_and_the_next_step_is_untouched(panda, home, change, sentence):
    planner, other = (ftqp.Planner(panda, DT) for _ in range(2))
    target = ftqp.Target(pose=home, twist=[0.05, 0, 0, 0, 0, 0])
    given = {"q": panda.neutral, "v": np.zeros(7), "target": target} | change
    planner.reset(panda.neutral)
    other.reset(panda.neutral)
    with pytest.raises(InputError, match=sentence):
        planner.step(**given)
    a = planner.step(panda.neutral, np.zeros(7), target)
    b = other.step(panda.neutral, np.zeros(7), target)
    np.testing.assert_array_equal(a.a, b.a)


@pytest.mark.parametrize("speed", ["0.5", "1_0", 0.0, 1.5, np.nan, 10**400, [0.5], None])
def test_speed_that_is_no_share_is_refused(panda, speed):
    with pytest.raises(InputError, match=r"^speed is "):
        ftqp.Planner(panda, DT).speed = speed


@pytest.mark.parametrize("backend", ["active_set", "dtrnn", "daqp"])
def test_step_before_reset_raises(panda, home, backend):
    with pytest.raises(
        InputError, match=r"the planner has no start; call planner\.reset\(q\) before the first step"
    ):
        ftqp.Planner(panda, backend=backend).step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))


def test_position_target_is_refused_by_a_task_with_rotation_rows_only(panda, home):
    target = ftqp.Target(position=home[:3, 3])
    planner = ftqp.Planner(panda)
    planner.reset(panda.neutral)
    with pytest.raises(InputError, match=r"the task has rotation rows but the target has a position only"):
        planner.step(panda.neutral, np.zeros(7), target)
    planner = ftqp.Planner(panda, task=ftqp.Task(rows="position"))
    planner.reset(panda.neutral)
    assert planner.step(panda.neutral, np.zeros(7), target).status is ftqp.StepStatus.OK


@pytest.mark.parametrize(
    ("backend", "bad"), [("active_set", np.nan), ("active_set", -np.inf), ("daqp", np.inf)]
)
@pytest.mark.parametrize("what", ["pose", "twist", "acceleration"])
def test_a_target_that_is_not_finite_brakes_at_once_and_the_loop_recovers(
    panda, home, level, what, bad, backend
):
    planner = ftqp.Planner(panda, DT, level=level, backend=backend)
    q, v = panda.neutral.copy(), np.full(7, 0.1)
    planner.reset(q, v)
    target = ftqp.Target(pose=home)
    for _ in range(3):
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
    broken = ftqp.Target(pose=home)
    getattr(broken, what).reshape(-1)[1] = bad
    step = planner.step(q, v, broken)
    limits = panda.limits
    assert step.status is ftqp.StepStatus.INVALID_INPUT and "not used: it is not finite" in step.notice
    assert np.isfinite(step.q).all() and np.all(np.abs(step.v) < np.abs(v))
    assert np.all(np.abs(step.a) <= limits.a_max * (1 + 1e-9))
    assert np.all(step.q > limits.q_min) and np.all(step.q < limits.q_max)
    step = planner.step(step.q.copy(), step.v.copy(), target)
    assert step.status in GOOD and np.isfinite(step.a).all()


@pytest.mark.parametrize(
    ("backend", "bad"), [("active_set", np.nan), ("active_set", -np.inf), ("daqp", np.inf)]
)
@pytest.mark.parametrize("what", ["q", "v", "tau", "tip"])
def test_a_measurement_that_is_not_finite_is_not_used_and_stops_the_arm_when_it_lasts(
    panda, home, level, what, bad, backend
):
    planners = [ftqp.Planner(panda, DT, level=level, backend=backend) for _ in range(2)]
    q, v = panda.neutral.copy(), np.full(7, 0.05)
    target = ftqp.Target(pose=home)
    for planner in planners:
        planner.reset(q, v)
    for tick in range(200):
        given = {"q": q.copy(), "v": v.copy(), "tau": np.zeros(7), "tip": panda.pose(q)}
        expected = planners[0].step(given["q"], given["v"], target, tau=given["tau"], tip=given["tip"])
        if tick >= 3:
            given[what].reshape(-1)[1] = bad
        step = planners[1].step(given["q"], given["v"], target, tau=given["tau"], tip=given["tip"])
        if 3 <= tick < 3 + round(0.02 / DT):
            assert step.status is ftqp.StepStatus.INVALID_INPUT
            who = "what was measured of panda_joint2" if what == "q" else "the target or a measurement"
            assert step.notice.startswith(who) and step.copy().notice == step.notice
            np.testing.assert_allclose(step.q, expected.q, rtol=0, atol=1e-9)
        assert np.all(np.abs(step.a) <= panda.limits.a_max * (1 + 1e-9))
        q, v = step.q.copy(), step.v.copy()
    assert step.status is ftqp.StepStatus.STOPPED and np.abs(step.v).max() < 1e-12
    assert "sensor" in planners[1].stopped_because
    assert planners[1].resume() is (what != "q")


@pytest.mark.parametrize("magnitude", [1e6, 1e100, 1e300])
@pytest.mark.parametrize("what", ["q", "v", "pose", "twist", "acceleration"])
def test_absurd_but_finite_input_gives_a_finite_command(panda, home, level, what, magnitude):
    planner = ftqp.Planner(panda, DT, level=level)
    planner.reset(panda.neutral)
    target = ftqp.Target(pose=home)
    state = {"q": panda.neutral.copy(), "v": np.zeros(7)}
    (state[what] if what in state else getattr(target, what)).reshape(-1)[3] = magnitude
    step = planner.step(state["q"], state["v"], target)
    assert np.isfinite(step.q).all() and np.isfinite(step.v).all() and np.isfinite(step.a).all()
    if what != "v":
        assert np.all(np.abs(step.a) <= panda.limits.a_max * (1 + 1e-9))


@pytest.mark.parametrize("backend", ["active_set", "dtrnn", "daqp"])
def test_own_arrays_of_the_step_may_be_handed_back_as_the_state(panda, home, level, backend):
    target = ftqp.Target(pose=home, twist=[0.05, 0.05, 0, 0, 0, 0])
    runs = []
    for keep in (np.array, lambda x: x):
        planner = ftqp.Planner(panda, DT, level=level, backend=backend)
        planner.reset(panda.neutral)
        q, v = panda.neutral, np.zeros(7)
        for _ in range(50):
            step = planner.step(q, v, target)
            q, v = keep(step.q), keep(step.v)
        runs.append(step.q.copy())
    np.testing.assert_array_equal(*runs)


def test_measured_tip_shifts_the_error_for_that_step_only(panda, home):
    planner = ftqp.Planner(panda, DT)
    planner.reset(panda.neutral)
    moved = home.copy()
    moved[:3, 3] += [0.01, -0.02, 0.03]
    target = ftqp.Target(pose=home)
    step = planner.step(panda.neutral, np.zeros(7), target, tip=moved)
    np.testing.assert_allclose(step.task_error[:3], [-0.01, 0.02, -0.03], atol=1e-15)
    assert step.position_error == pytest.approx(np.sqrt(14.0) * 0.01)
    step = planner.step(panda.neutral, np.zeros(7), target)
    np.testing.assert_allclose(step.task_error, 0.0, atol=1e-14)
