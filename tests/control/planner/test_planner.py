"""What a planner takes and says: its start, its state as others may read it, inputs in any form."""

import logging

import numpy as np
import pytest
from tests.going import closed_loop, started

import ftqp
from ftqp.control.planner.mounted_robot import SPEED_SHARE, braking_reserve
from ftqp.core.errors import InputError, ModelError

DT = 2e-3


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"scheme": "mvm"}, r"'mvm' is not a scheme \(did you mean 'mvn'\?\); there are mvn, "),
        ({"dt": 0.0}, "dt is 0, expected a finite number > 0 s"),
        ({"dt": 1e-9}, "dt is .* s, expected at least 1e-06 s"),
        ({"posture": [0.0, 1.0]}, r"posture has shape \(2,\), expected \(nv,\) = \(7,\)"),
        ({"dt": 0.2}, r"kv is 20, but with dt = 0.2 s the feedback is unstable; expected kv < 10"),
        ({"dt": 0.2, "level": "velocity"}, r"kp is 10, but with dt = 0.2 s the feedback is unstable;"),
        ({"task": ftqp.Task(kp=4e6)}, r"kv is 4000, but with dt = 0.001 s the feedback is unstable"),
    ],
)
def test_wrong_parameter_is_refused_with_one_sentence(panda, given, sentence):
    with pytest.raises(InputError, match=sentence) as error:
        ftqp.Planner(panda, **given)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("scheme", ["mtn", "mke", "iiwt", "dlsm", "dlsm_mvn"])
def test_scheme_that_needs_inertia_is_refused_for_a_robot_without(srs7, level, scheme):
    with pytest.raises(
        InputError, match=r"scheme '\w+' needs inertia, which srs7 has not; use mvn, man or rmp"
    ):
        ftqp.Planner(srs7, scheme=scheme, level=level)


def test_robot_without_acceleration_limit_is_refused_with_the_joints_and_the_remedy(panda):
    a_max = panda.limits.a_max.copy()
    a_max[[1, 4]] = np.inf
    with pytest.raises(
        ModelError, match=r"no acceleration limit on panda_joint2, panda_joint5; .*with_limits\(a_max="
    ):
        ftqp.Planner(panda.with_limits(a_max=a_max))


@pytest.mark.parametrize(("q", "v", "sentence"), [
    (np.zeros(6), None, r"q has shape \(6,\), expected \(nv,\) = \(7,\)"),
    (np.full(7, np.nan), None, "q contains NaN at index 0"),
])  # fmt: skip
def test_reset_refuses_a_wrong_state(panda, q, v, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Planner(panda).reset(q, v)


def test_time_of_a_step_is_measured_only_when_asked(panda, home):
    for timing in (False, True):
        planner = started(panda, DT, timing=timing)
        time = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home)).qp.time
        assert (time is not None and 0.0 < time < 1.0) is timing


def test_arm_without_velocity_limits_is_told_of_those():
    arm = ftqp.Robot.from_dh([[0.0, 0.1, 0.3, 0.0], [0.0, 0.0, 0.3, 0.0]])
    with pytest.raises(ModelError, match=r"no velocity limit, .* on j1, j2; .*with_limits\(v_max=...\)$"):
        ftqp.Planner(arm)
    assert ftqp.Planner(arm.with_limits(v_max=1.0)).robot.limits.a_max.tolist() == [5.0, 5.0]


@pytest.fixture
def said(caplog):
    """The warnings of ftqp since the last call."""
    caplog.set_level(logging.WARNING, "ftqp")

    def messages():
        found = [record.getMessage() for record in caplog.records]
        caplog.clear()
        return found

    return messages


def test_singular_start_is_said_with_the_remedy(said):
    robot = ftqp.robots.load("iiwa14")
    ftqp.Planner(robot).reset(np.zeros(7))
    (message,) = said()
    assert message.startswith("iiwa14: the start is near a singularity of the task (sigma_min is ")
    assert message.endswith(
        "so directions of it may give way; start from another posture, such as robot.neutral"
    )


def test_rows_of_the_task_decide_what_is_singular(said):
    """The wrist of the PUMA aligned: attitude is lost, position is not."""
    robot = ftqp.robots.load("puma560")
    q = np.array([0.0, 0.8, -3.0, 0.0, 0.0, 0.0])
    ftqp.Planner(robot).reset(q)
    assert "near a singularity" in said()[0]
    ftqp.Planner(robot, task=ftqp.Task(rows="position")).reset(q)
    assert said() == []


def test_start_beyond_the_range_is_said_and_degrees_are_guessed(panda, said):
    planner = started(panda)
    q = panda.neutral.copy()
    q[1] = 2.0
    planner.reset(q)
    assert "the start is beyond the range of panda_joint2 2 (-1.763 to 1.763)" in said()[0]
    planner.reset(np.degrees(panda.neutral))
    assert "are these degrees?" in said()[0]


def test_weight_that_a_motor_cannot_hold_is_said(panda, said):
    weak = panda.with_limits(tau_max=[87.0, 87.0, 87.0, 10.0, 12.0, 12.0, 12.0])
    ftqp.Planner(weak).reset(panda.neutral)
    (message,) = said()
    assert "panda_joint4 needs " in message
    assert "beyond its limit of 10 N m, so the arm may sink" in message


def test_missing_redundancy_is_said_of_the_joints_that_work(panda, said):
    planner = ftqp.Planner(panda)
    planner.report(ftqp.Locked(2))
    planner.reset(panda.neutral)
    assert said() == [
        "panda: 6 joints that work for 6 task rows leave no redundancy, so a joint that fails costs a "
        "direction; follow fewer rows, Task(rows=...), if the work allows it"
    ]


def test_the_same_start_is_said_once_and_several_reasons_are_one_warning(said):
    robot = ftqp.robots.load("puma560")
    planner = started(robot, level="velocity", at=np.zeros(6))
    planner.reset(np.zeros(6))
    (message,) = said()
    assert "near a singularity" in message and "leave no redundancy" in message and "\n" not in message
    planner.reset(robot.neutral)
    (message,) = said()
    assert "near a singularity" not in message


@pytest.fixture(scope="module")
def panda_reserve():
    return braking_reserve(ftqp.robots.load("panda"))


def test_every_joint_can_brake_at_the_share_within_its_torque(panda, panda_reserve):
    pinocchio = pytest.importorskip("pinocchio")
    reserve = panda_reserve
    limits, generator = panda.limits, np.random.default_rng(1)
    share, guard = reserve.shares(limits.a_max, limits.tau_max)
    assert 0.0 < guard <= share <= 1.0
    data = panda.model.createData()
    for _ in range(300):
        q = generator.uniform(limits.q_min, limits.q_max)
        v = generator.uniform(-1.0, 1.0, 7) * SPEED_SHARE * limits.v_max
        a = guard * limits.a_max * generator.choice([-1.0, 1.0], 7)
        assert np.all(np.abs(pinocchio.rnea(panda.model, data, q, v, a)) <= limits.tau_max)


def test_share_is_the_largest_that_all_samples_allow():
    """A planar arm without gravity has |h| = 0 at rest: the share follows from |M| a_max alone."""
    robot = ftqp.robots.load("planar(1)")
    reserve = braking_reserve(robot)
    inertia = 4.0 * 1.5 * 1.5**2 / 3.0  # a rod about its end
    for share in (0.3, 0.7):
        tau_max = np.array([share * inertia * robot.limits.a_max[0]])
        expected = pytest.approx((share, share / 1.3), rel=1e-9)
        assert reserve.shares(robot.limits.a_max, tau_max) == expected


GOOD = (ftqp.StepStatus.OK, ftqp.StepStatus.RELAXED)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"q": np.zeros(6)}, r"q has shape \(6,\), expected \(nv,\) = \(7,\)"),
        ({"v": [0.0] * 6 + ["fast"]}, "v is not an array of numbers"),
        ({"target": np.eye(4)}, r"target is ndarray, expected ftqp\.Target"),
        ({"target": None}, r"step got no target; its second argument is the measured velocity"),
        ({"_": 3}, r"step got 3 behind its target, expected nothing; give tau, tip and ticks by name"),
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


@pytest.mark.parametrize("speed", ["0.5", 0.0, 1.5, np.nan, None])
def test_speed_that_is_no_share_is_refused(panda, speed):
    with pytest.raises(InputError, match=r"^speed is "):
        ftqp.Planner(panda, DT).speed = speed


@pytest.mark.parametrize("backend", ["active_set", "dtrnn", "daqp"])
def test_step_before_reset_raises(panda, home, backend):
    with pytest.raises(
        InputError, match=r"the planner has no start; call planner\.reset\(q\) before the first step"
    ):
        ftqp.Planner(panda, backend=backend).step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))


@pytest.mark.parametrize(
    ("backend", "bad"), [("active_set", np.nan), ("active_set", -np.inf), ("daqp", np.inf)]
)
@pytest.mark.parametrize("what", ["pose", "twist", "acceleration"])
def test_a_target_that_is_not_finite_brakes_at_once_and_the_loop_recovers(
    panda, home, level, what, bad, backend
):
    planner = ftqp.Planner(panda, DT, level=level, backend=backend)
    target = ftqp.Target(pose=home)
    *_, step = closed_loop(planner, target, 3, v=np.full(7, 0.1))
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
def test_a_measurement_that_is_not_finite_is_not_used_and_stops_the_arm_or_its_joint_when_it_lasts(
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
    if what == "q":  # one joint's sensor: it stays where it was sent, and the others go on
        assert planners[1].stopped_because is None and list(planners[1].faults) == ["panda_joint2"]
        assert step.v[1] == 0.0 and step.position_error < 1e-3
    else:
        assert step.status is ftqp.StepStatus.STOPPED and np.abs(step.v).max() < 1e-12
        assert "sensor" in planners[1].stopped_because and planners[1].resume()


@pytest.mark.parametrize("magnitude", [1e6, 1e100, 1e300])
@pytest.mark.parametrize("what", ["q", "v", "pose", "twist", "acceleration"])
def test_absurd_but_finite_input_gives_a_finite_command(panda, home, level, what, magnitude):
    planner = started(panda, DT, level=level)
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
        planner = started(panda, DT, level=level, backend=backend)
        q, v = panda.neutral, np.zeros(7)
        for _ in range(50):
            step = planner.step(q, v, target)
            q, v = keep(step.q), keep(step.v)
        runs.append(step.q.copy())
    np.testing.assert_array_equal(*runs)


def test_measured_tip_shifts_the_error_for_that_step_only(panda, home):
    planner = started(panda, DT)
    moved = home.copy()
    moved[:3, 3] += [0.01, -0.02, 0.03]
    target = ftqp.Target(pose=home)
    step = planner.step(panda.neutral, np.zeros(7), target, tip=moved)
    np.testing.assert_allclose(step.task_error[:3], [-0.01, 0.02, -0.03], atol=1e-15)
    assert step.position_error == pytest.approx(np.sqrt(14.0) * 0.01)
    step = planner.step(panda.neutral, np.zeros(7), target)
    np.testing.assert_allclose(step.task_error, 0.0, atol=1e-14)


PANDA = ftqp.robots.load("panda")
SHORT = 1e-4


def test_motion_of_the_tip_has_the_derivatives_of_its_pose():
    rng = np.random.default_rng(2)
    view = ftqp.Planner(PANDA).view()
    q, v, a = PANDA.neutral, rng.uniform(-1, 1, 7), rng.uniform(-5, 5, 7)

    def at(t):
        return view.tip_at(type(view.command)(q + t * v + 0.5 * t * t * a, v + t * a, a))

    before, now, after = at(-SHORT), at(0.0), at(SHORT)
    speed = (after.pose[:3, 3] - before.pose[:3, 3]) / (2.0 * SHORT)
    assert np.abs(now.twist[:3] - speed).max() < 1e-6
    change = (after.twist - before.twist) / (2.0 * SHORT)
    assert np.abs(now.acceleration - change).max() < 1e-5
    assert np.abs(now.pose - PANDA.pose(q)).max() < 1e-12


def test_view_follows_the_planner_and_its_belief():
    planner = ftqp.Planner(PANDA)
    view = planner.view()
    assert not view.is_reset
    planner.reset(PANDA.neutral)
    before = view.belief
    assert view.is_reset and view.ticks == 0 and view.belief == before
    step = planner.step(PANDA.neutral, np.zeros(7), ftqp.Target(pose=PANDA.pose(PANDA.neutral + 0.01)))
    assert view.ticks == 1
    for got, expected in zip(view.command, (step.q, step.v, step.a), strict=True):
        np.testing.assert_array_equal(got, expected)
    planner.report(ftqp.Degraded(2, velocity=0.5))
    assert view.belief != before and view.limits.v[2] == 0.5 * PANDA.limits.v_max[2]
    planner.report(ftqp.Locked(1, mode="instant"))
    assert view.working.tolist() == [True, False, True, True, True, True, True]
