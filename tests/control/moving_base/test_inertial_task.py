"""The inertial task, the gain of a moving base, and that nothing of the world makes either raise."""

import numpy as np
import pytest

import ftqp
from ftqp.control.moving_base.base_gain import (
    best_lowpass,
)
from ftqp.core.pose import rotation_exp, transform

DT = 0.01


def velocity_planner(robot, **options):
    options = {"level": "velocity", "emergency": None, **options}
    return ftqp.Planner(robot, DT, **options)


@pytest.fixture
def base():
    return transform(rotation_exp(np.array([0.3, -0.2, 0.9])), np.array([0.4, -1.0, 0.2]))


def closed_loop(follower, pose_of, ticks, q=None, **given):
    """Hold the first pose in space while the base moves as ``pose_of(k)``; the last step and q."""
    robot = follower.planner.robot
    q, v = (robot.neutral if q is None else q).copy(), np.zeros(robot.nv)
    goal = ftqp.Target(pose=pose_of(0) @ robot.pose(q))
    follower.reset(q)
    for k in range(ticks):
        step = follower.step(q, v, goal, tip=pose_of(k) @ robot.pose(q), **given)
        q, v = step.q.copy(), step.v.copy()
    return step, q


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"sensing": "unknwon"}, r"sensing is 'unknwon' \(did you mean 'unknown'\?\), expected one of"),
        ({"observer": 0.3}, r"observer is 0.3, expected ftqp.Observer\(...\) or None"),
        ({"delay": 0.1}, "sensing is 'unknown' with a delay of 0.1 s; a delay goes with 'late' only"),
        ({"sensing": "late"}, "sensing is 'late' with a delay of 0 s"),
        ({"sensing": "late", "delay": np.nan}, "delay is nan"),
        ({"nominal": np.eye(2)}, r"nominal has shape \(2, 2\), expected"),
    ],
)
def test_wrong_base_is_one_clear_sentence(given, sentence):
    with pytest.raises(ftqp.InputError, match=sentence):
        ftqp.MovingBase(**given)


@pytest.mark.parametrize(
    ("planner", "given", "sentence"),
    [
        ({"level": "acceleration"}, {}, "leader 'base' does not go with level 'acceleration': .*; make the"),
        ({"task": ftqp.Task(mode="scaled")}, {}, "leader 'base' does not go with mode 'scaled': an"),
        ({"task": ftqp.Task(kp=5.0)}, {}, "task kp is 5, but here gain sets it to gain/dt; leave kp out"),
        ({}, {"gain": 2.0}, "gain is 2, but the loop is unstable from 2 on"),
        ({}, {"gain": 0.0}, "gain is 0, expected a finite number > 0"),
    ],
)
def test_wrong_inertial_task_is_one_clear_sentence(panda, planner, given, sentence):
    with pytest.raises(ftqp.InputError, match=sentence):
        ftqp.InertialTask(velocity_planner(panda, **planner), **given)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"tip": np.eye(3)}, r"tip has shape \(3, 3\), expected \(4, 4\)"),
        ({"tip": [["a"] * 4] * 4}, "tip is not an array of numbers"),
        ({"tip": np.zeros(3)}, "tip is a position, .* but the task has rotation rows"),
    ],
)
def test_wrong_measurement_is_one_clear_sentence(panda, home, given, sentence):
    follower = ftqp.InertialTask(velocity_planner(panda))
    follower.reset(panda.neutral)
    with pytest.raises(ftqp.InputError, match=sentence):
        follower.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home), **given)


@pytest.mark.parametrize("backend", ["active_set", "daqp"])
def test_moving_base_is_followed_with_any_solver(panda, base, backend):
    def pose_of(k):
        return base @ transform(rotation_exp(np.array([0.0, 0.0, 2e-3 * k])), np.array([1e-3 * k, 0.0, 0.0]))

    follower = ftqp.InertialTask(
        velocity_planner(panda, backend=backend), ftqp.MovingBase(observer=ftqp.Observer())
    )
    step, _ = closed_loop(follower, pose_of, 40)
    assert np.linalg.norm(follower.error[:3]) < 2e-5 and step.status is ftqp.StepStatus.OK
    np.testing.assert_allclose(follower.observed_twist[3:], base[:3, :3] @ [0.0, 0.0, 0.2], atol=1e-4)


@pytest.mark.parametrize("bad", ["none", "nan", "inf"])
def test_base_that_is_not_seen_is_held_and_then_the_arm_brakes(panda, base, bad):
    follower = ftqp.InertialTask(velocity_planner(panda), ftqp.MovingBase(patience=0.02))
    step, q = closed_loop(follower, lambda k: base @ transform(np.eye(3), np.array([2e-3 * k, 0, 0])), 10)
    v = step.v.copy()
    assert np.abs(v).max() > 0.05
    goal = ftqp.Target(pose=base @ panda.pose(q))
    tip = {"none": None, "nan": np.full((4, 4), np.nan), "inf": np.full((4, 4), np.inf)}[bad]
    said = []
    for _ in range(60):
        step = follower.step(q, v, goal, tip=tip)
        assert np.all(np.isfinite(step.v))
        assert np.all(np.abs(step.v - v) <= panda.limits.a_max * DT * (1.0 + 1e-9))
        q, v = step.q.copy(), step.v.copy()
        said.append((follower.status, step.status))
    assert {status for status, _ in said} == {ftqp.BaseStatus.STALE}
    assert [status for _, status in said[:2]].count(ftqp.StepStatus.INVALID_INPUT) == 0
    assert said[-1][1] is ftqp.StepStatus.INVALID_INPUT and np.abs(v).max() < 1e-9
    goal = ftqp.Target(pose=base @ panda.pose(q))
    follower.step(q, v, goal, tip=goal.pose)
    assert follower.status is ftqp.BaseStatus.TRACKING


def test_first_step_without_a_measurement_keeps_the_arm_at_rest(panda, home):
    follower = ftqp.InertialTask(velocity_planner(panda))
    follower.reset(panda.neutral)
    step = follower.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    assert follower.status is ftqp.BaseStatus.STALE and step.status is ftqp.StepStatus.INVALID_INPUT
    assert np.all(step.v == 0.0)


@pytest.mark.parametrize("where", ["q", "target"])
def test_other_invalid_input_is_not_blamed_on_the_base(panda, base, where):
    follower = ftqp.InertialTask(velocity_planner(panda))
    closed_loop(follower, lambda k: base, 2)
    target = ftqp.Target(pose=np.eye(4))
    q = panda.neutral.copy()
    if where == "q":
        q[2] = np.nan
    else:
        target.pose[0, 3] = np.nan
    step = follower.step(q, np.zeros(7), target, tip=base @ panda.pose(panda.neutral))
    assert step.status is ftqp.StepStatus.INVALID_INPUT and follower.status is ftqp.BaseStatus.HALTED
    assert np.all(np.isfinite(step.v))


def test_tip_out_of_reach_is_called_so(panda, base):
    follower = ftqp.InertialTask(velocity_planner(panda, task=ftqp.Task(rows="position")))

    def pose_of(k):
        return base @ transform(np.eye(3), np.array([-min(1.5, 5e-3 * k), 0.0, 0.0]))

    closed_loop(follower, pose_of, 900)
    assert follower.status in (ftqp.BaseStatus.UNREACHABLE, ftqp.BaseStatus.RANK_DEFICIENT)
    assert np.linalg.norm(follower.error[:3]) > 0.1


def test_fast_base_saturates_the_arm_for_a_while(panda, base):
    follower = ftqp.InertialTask(velocity_planner(panda))
    jump = transform(np.eye(3), np.array([0.0, 0.15, 0.0]))
    closed_loop(follower, lambda k: base if k < 2 else base @ jump, 6)
    assert follower.status is ftqp.BaseStatus.SATURATED
    step, _ = closed_loop(follower, lambda k: base if k < 2 else base @ jump, 200)
    assert follower.status is ftqp.BaseStatus.TRACKING and np.linalg.norm(follower.error) < 1e-6
    assert step.status is ftqp.StepStatus.OK


def loop(moved, gain, lowpass=None, noise=0.0, seed=1):
    """e_k+1 = e_k - k_c (e_k + n_k) + dv_k - d_k+1 with the observer of measured increments, one axis."""
    n = noise * np.random.default_rng(seed).standard_normal(len(moved))
    e, shift, last, u = 0.0, 0.0, None, 0.0
    out = np.empty(len(moved))
    for k, d in enumerate(moved):
        e -= u + d
        seen = e + n[k]
        if lowpass is not None and last is not None:
            shift += lowpass * (-(seen - last) - u - shift)
        last, u = seen, gain * seen - shift
        out[k] = e
    return out


@pytest.mark.parametrize(
    ("degrees", "limit"), [(0, 2.0), (10, 1.9696), (30, 1.7321), (60, 1.0), (90, 0.0), (150, 0.0)]
)
def test_gain_limit_is_twice_the_best_gain(degrees, limit):
    alpha = np.deg2rad(degrees)
    assert ftqp.gain_limit(alpha) == pytest.approx(limit, abs=1e-4)
    assert ftqp.gain_limit(-alpha) == 2.0 * ftqp.best_gain(alpha)


@pytest.mark.parametrize("alpha", [4.0, np.nan])
def test_angle_beyond_half_a_turn_is_refused(alpha):
    with pytest.raises(ftqp.InputError, match="expected an angle of at most pi"):
        ftqp.best_gain(alpha)


@pytest.mark.parametrize("gain", [0.4, 1.0, 1.6])
@pytest.mark.parametrize("lowpass", [None, 0.3, 1.0])
def test_sensitivity_is_that_of_the_loop(gain, lowpass):
    observer = None if lowpass is None else ftqp.Observer(lowpass=lowpass)
    for omega in (1.0, 20.0, 150.0):
        t = DT * np.arange(4000)
        found = loop(np.diff(np.sin(omega * t), prepend=0.0), gain, lowpass)[2000:]
        basis = np.stack([np.sin(omega * t[2000:]), np.cos(omega * t[2000:])], axis=1)
        amplitude = np.linalg.norm(np.linalg.lstsq(basis, found, rcond=None)[0])
        assert amplitude == pytest.approx(float(ftqp.sensitivity(omega, DT, gain, observer)), rel=1e-6)


@pytest.mark.parametrize("noise", [2e-5, 1e-4, 1e-3])
def test_best_lowpass_at_gain_one_solves_the_equation_of_the_docstring(noise):
    a = best_lowpass(noise, 0.3, DT)
    assert a**1.5 == pytest.approx((1.0 - 0.5 * a) * 0.3 * DT**2 / noise, rel=1e-5)
    assert ftqp.Observer(noise=noise, acceleration=0.3).factor(DT) == a


@pytest.mark.parametrize("gain", [0.5, 1.0])
def test_best_lowpass_beats_others_in_the_loop(gain):
    noise, acceleration = 1e-4, 0.3
    moved = acceleration * DT**2 * np.arange(20_000)

    def mean_square(a):
        return np.mean(loop(moved, gain, a, noise)[500:] ** 2)

    a = best_lowpass(noise, acceleration, DT, gain)
    assert mean_square(a) < min(mean_square(0.7 * a), mean_square(min(1.0, 1.4 * a)))
