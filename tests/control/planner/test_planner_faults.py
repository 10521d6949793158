"""What a planner does with the joints that it is told have failed."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

DT = 2e-3


def test_unknown_joint_of_a_report_names_the_valid_ones_and_the_nearest(panda):
    planner = ftqp.Planner(panda)
    with pytest.raises(
        InputError, match=r"'panda_joint0' is not a joint of panda \(did you mean .*; it has panda_joint1, "
    ):
        planner.report(ftqp.Locked("panda_joint0"))
    with pytest.raises(InputError, match=r"'elbow' is not a joint of panda.*; it has panda_joint1, "):
        planner.withdraw("elbow")
    assert planner.faults == {}


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
