"""What a planner does with the joints that it is told have failed."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.core.errors import InputError

DT = 2e-3


def circle(robot, radius=0.08, duration=1.5, axes=("y", "z")):
    """Targets along a circle, by tick."""
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius, duration=duration, axes=axes)
    sample = path.sample(np.arange(round(duration / DT)) * DT)
    target = ftqp.Target(pose=path.start)

    def at(k):
        target.pose[:], target.twist[:] = sample.pose[k], sample.twist[k]
        target.acceleration[:] = sample.acceleration[k]
        return target

    return at, len(sample.pose)


def test_unknown_joint_of_a_report_names_the_valid_ones_and_the_nearest(panda):
    planner = ftqp.Planner(panda)
    with pytest.raises(
        InputError, match=r"'panda_joint0' is not a joint of panda \(did you mean .*; it has panda_joint1, "
    ):
        planner.report(ftqp.Locked("panda_joint0"))
    with pytest.raises(InputError, match=r"'elbow' is not a joint of panda.*; it has panda_joint1, "):
        planner.withdraw("elbow")
    assert planner.faults == {}


@pytest.mark.parametrize("joint", range(7))
def test_locked_joint_comes_to_rest_and_never_moves_again(panda, level, follow, joint):
    at, ticks = circle(panda)
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    steps = [
        s.copy() for s in follow(planner, at, ticks, events={300: lambda p: p.report(ftqp.Locked(joint))})
    ]
    v = np.array([s.v[joint] for s in steps])
    rest = 300 + int(np.argmax(v[300:] == 0.0))
    rate = 0.25 * panda.limits.a_max[joint]
    assert 300 <= rest < 300 + 2 + int(abs(v[299]) / (rate * DT)) + 1
    assert (v[rest:] == 0.0).all() and all(s.a[joint] == 0.0 for s in steps[rest + 1 :])
    assert len({s.q[joint] for s in steps[rest + 1 :]}) == 1


def test_locked_joint_is_held_where_it_is_measured_whatever_velocity_is_measured(panda, level):
    at, _ = circle(panda)
    planner = ftqp.Planner(panda, DT, level=level)
    planner.reset(panda.neutral)
    planner.report(ftqp.Locked(3))
    generator = np.random.default_rng(0)
    for k in range(20):
        q, v = panda.neutral + 1e-4 * generator.normal(size=7), 1e-3 * generator.normal(size=7)
        step = planner.step(q, v, at(0))
        if k > 1:
            assert step.v[3] == 0.0 and step.a[3] == 0.0
            assert abs(step.q[3] - panda.neutral[3]) < 3e-4


def test_arm_with_every_joint_locked_from_the_start_stops(panda, level, follow, home):
    planner = ftqp.Planner(panda, DT, level=level)
    for joint in range(7):
        planner.report(ftqp.Locked(joint))
    target = ftqp.Target(pose=home)

    def leaving(k):
        target.position[:] = home[:3, 3] + [1e-3 * k, 0.0, 0.0]
        return target

    last = [s.status for s in follow(planner, leaving, 80)][-1]
    assert last is ftqp.StepStatus.STOPPED


def test_faults_of_different_kinds_hold_together(panda, level, follow):
    at, ticks = circle(panda, radius=0.03, duration=2.0)

    def several(planner):
        planner.report(ftqp.Locked("panda_joint3"))
        planner.report(ftqp.Degraded("panda_joint2", velocity=0.3, acceleration=0.3))
        planner.report(ftqp.FreeSwinging("panda_joint7", damping=3.0))

    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    assert planner.faults == {}
    q, v = panda.neutral, np.zeros(7)
    for k, step in enumerate(follow(planner, at, ticks, events={200: several})):
        assert np.isfinite(step.a).all()
        if k > 700:
            assert step.v[2] == 0.0 and step.tau[6] == 0.0
            assert abs(step.v[1]) <= 0.3 * panda.limits.v_max[1] + 1e-12
            assert abs(step.a[1]) <= 0.3 * panda.limits.a_max[1] * (1 + 1e-9)
            arm = arm_at(panda, q, v)
            assert abs(arm.M[6] @ step.a + arm.h[6] + 3.0 * step.v[6]) < 1e-6
        q, v = step.q.copy(), step.v.copy()
    assert list(planner.faults) == ["panda_joint2", "panda_joint3", "panda_joint7"]


def test_joint_degraded_below_its_speed_brakes_with_no_more_than_it_has_left(panda, level, follow):
    target = ftqp.Target(pose=panda.pose(panda.neutral))
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    planner.report(ftqp.Degraded(0, velocity=0.1, acceleration=0.2))
    v0 = np.zeros(7)
    v0[0] = 0.9 * panda.limits.v_max[0]
    left, speed = 0.2 * panda.limits.a_max[0], v0[0]
    slow = 0.1 * panda.limits.v_max[0]
    for step in follow(planner, target, 800, v=v0):
        assert abs(step.a[0]) <= left * (1.0 + 1e-9)
        if speed > slow + left * DT:
            assert step.a[0] == pytest.approx(-left, rel=1e-9)
        speed = step.v[0]
    assert abs(speed) <= slow + 1e-12


def test_joint_that_failed_outside_its_limits_blocks_nothing(panda, level, follow):
    q = panda.neutral.copy()
    q[4] = panda.limits.q_max[4] + 0.05
    home = panda.pose(q)
    path = ftqp.paths.Line(home, [0.0, 0.05, 0.0], duration=1.0)
    sample = path.sample(np.arange(500) * DT)
    target = ftqp.Target(pose=home)

    def at(k):
        target.pose[:], target.twist[:], target.acceleration[:] = (
            sample.pose[k], sample.twist[k], sample.acceleration[k])  # fmt: skip
        return target

    planner = ftqp.Planner(panda, DT, level=level)
    planner.report(ftqp.Locked(4))
    steps = [s.copy() for s in follow(planner, at, 500, q=q)]
    assert {s.status for s in steps} == {ftqp.StepStatus.RELAXED}
    assert all(s.outside == ("panda_joint5",) and not s.certificate.unreached for s in steps)
    assert all(s.q[4] == q[4] for s in steps) and steps[-1].position_error < 1e-3


@pytest.mark.parametrize(
    "fault", [ftqp.Locked(3), ftqp.Degraded(3, velocity=0.5), ftqp.FreeSwinging(3, 1.0)], ids=str
)
def test_fault_may_be_reported_before_reset_and_survives_it(panda, home, fault):
    planner = ftqp.Planner(panda, DT)
    planner.report(fault)
    planner.reset(panda.neutral)
    planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    planner.reset(panda.neutral)
    assert planner.faults == {"panda_joint4": fault}
