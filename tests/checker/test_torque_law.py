"""When a torque beyond its limit is without need: by a linear program with the checker's own limits."""

from dataclasses import replace

import numpy as np
import pytest
from tests.checker.panda_runs import ARM, ROBOT, trace_of

from ftqp.checker.model_file import ModelFile
from ftqp.checker.torque_law import accelerations, torque
from ftqp.checker.trace import KINEMATIC, PHYSICS, Failure, Plane

DT = 0.01


def still(q=ROBOT.neutral, status="RELAXED", ticks=5, **changes):
    """An arm that stands."""
    place, zero = np.tile(q, (ticks + 1, 1)), np.zeros((ticks + 1, ROBOT.nv))
    trace = trace_of(place, zero, DT, status=[status] * ticks)
    return replace(trace, **changes)


def left(share, joint=1, **shares):
    """What is left of a joint's torque, as a share of what holds it against gravity."""
    load = abs(ARM.torques(ROBOT.neutral[None], np.zeros((1, 7)), np.zeros((1, 7)))[0, joint])
    part = {"tau_max": share * load / ARM.tau_max[joint]} | shares
    return [Failure(joint=joint, kind="degraded", since=0.0, reported_at=0.0, shares=part)]


def locked(*joints):
    return [Failure(joint=i, kind="locked", since=-1.0, reported_at=-1.0) for i in joints]


def broken(run):
    return bool((torque(ARM, run, KINEMATIC) > 0.0).any())


def test_mass_matrix_and_bias_are_those_of_the_torques_with_rotors_and_friction():
    arm = ModelFile.read(ROBOT.to_urdf(), ROBOT.tip)
    arm.model.armature = np.linspace(0.1, 0.7, 7)
    arm = replace(arm, friction=np.linspace(0.7, 0.1, 7))
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-1.0, 1.0, (3, 7))
    M, h = arm.dynamics(q, v)
    np.testing.assert_allclose(M @ a + h, arm.torques(q[None], v[None], a[None])[0], atol=1e-9)


@pytest.mark.parametrize(
    ("share", "sinks", "found"), [(1.1, 1.0, False), (0.7, 1.0, True), (0.7, 0.001, False)]
)
def test_torque_counts_under_relaxed_where_the_joints_could_have_kept_it(share, sinks, found):
    """With seven tenths of its load a joint has to sink, if it and the others may do so fast enough."""
    slow = [
        Failure(joint=i, kind="degraded", since=0.0, reported_at=0.0, shares={"a_max": sinks})
        for i in range(7)
        if i != 1
    ]
    assert broken(still(failures=[*left(share, a_max=sinks), *slow])) == found


def test_torque_counts_always_under_ok_and_else_not_where_none_is_minded_or_a_point_is_kept():
    assert broken(still(failures=left(0.01), status="OK"))
    assert not broken(still(failures=left(0.7), minds_torques=False))
    table = Plane(joint=6, at_zero=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), offset=-1.0)
    assert not broken(still(failures=left(0.7), planes=[table]))


def test_nothing_is_asked_of_a_joint_that_is_locked():
    others = locked(0, 2, 3, 4, 5, 6)
    assert broken(still(failures=[*left(0.7), *others]))
    assert not broken(still(failures=[*others, *locked(1)]))


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_room_of_accelerations_keeps_speed_and_range(level):
    rng = np.random.default_rng(2)
    limits = {name: getattr(ARM, name)[None] for name in ("q_min", "q_max", "v_max", "a_max", "tau_max")}
    half = 0.5 if level == "acceleration" else 1.0
    for _ in range(50):
        q = rng.uniform(ARM.q_min, ARM.q_max)
        v = rng.uniform(-0.2, 0.2, 7) * ARM.v_max
        run = still(level=level, q=np.tile(q, (6, 1)), v=np.tile(v, (6, 1)))
        low, high = accelerations(run, 0, limits)
        assert (low <= high).all() and (np.abs([low, high]) <= ARM.a_max).all()
        for a in (low, high):
            after, place = v + DT * a, q + DT * (v + half * DT * a)
            assert (np.abs(after) <= ARM.v_max).all()
            fits = (place <= ARM.q_max) & (place >= ARM.q_min)
            late = np.abs(a) > 0.97 * ARM.a_max  # brakes fully, as nothing else is left
            assert (fits | late).all()


def test_joint_that_runs_to_its_end_has_to_brake():
    q, v = ROBOT.neutral.copy(), np.zeros(7)
    v[3] = 0.5
    q[3] = ARM.q_max[3] - 1.1 * v[3] ** 2 / (2.0 * ARM.a_max[3])
    run = still(q=np.tile(q, (6, 1)), v=np.tile(v, (6, 1)))
    limits = {name: getattr(ARM, name)[None] for name in ("q_min", "q_max", "v_max", "a_max", "tau_max")}
    low, high = accelerations(run, 0, limits)
    assert low[3] <= high[3] < -0.5 * ARM.a_max[3]
    assert (high[:3] > 0.9 * ARM.a_max[:3]).all()


@pytest.mark.parametrize(
    ("status", "brakes", "speed", "found"),
    [
        ("STOPPED", True, 0.0, False),
        ("STOPPED", False, 0.0, True),
        ("RELAXED", True, 0.0, True),
        ("STOPPING", True, 0.3, False),
        ("STOPPING", True, -0.3, True),
    ],
)
def test_torque_that_slows_or_holds_a_joint_in_a_stop_may_be_that_of_its_brake(status, brakes, speed, found):
    load = ARM.torques(ROBOT.neutral[None], np.zeros((1, 7)), np.zeros((1, 7)))[0, 1]
    v = np.zeros((6, 7))
    v[:, 1] = -speed * np.sign(load)
    run = still(status=status, v=v, failures=left(0.7), brakes=brakes)
    assert bool((torque(ARM, run, PHYSICS) > 0.0).any()) == found


def test_end_stop_carries_a_joint_that_is_beyond_its_range():
    q = ROBOT.neutral.copy()
    q[3] = ARM.q_min[3] - 0.01
    load = abs(ARM.torques(q[None], np.zeros((1, 7)), np.zeros((1, 7)))[0, 3])
    for place, found in ((q[3], False), (ARM.q_min[3] + 0.01, True)):
        q[3] = place
        weak = Failure(
            joint=3, kind="degraded", since=0.0, reported_at=0.0, shares={"tau_max": 0.7 * load / 87.0}
        )
        assert broken(still(q=q, failures=[weak])) == found


def test_dry_friction_may_carry_what_it_can():
    run = still(failures=left(0.7))
    for friction, found in ((0.2, True), (0.4, False)):
        load = abs(ARM.torques(run.q[:1], run.v[:1], run.v[:1])[0, 1])
        rubs = replace(ARM, dry_friction=np.where(np.arange(7) == 1, friction * load, 0.0))
        assert bool((torque(rubs, run, KINEMATIC) > 0.0).any()) == found


@pytest.mark.parametrize(("hold", "found"), [((0.01, 0.03), False), ((0.03, 0.05), True), (None, True)])
def test_torque_of_what_holds_all_joints_at_once_is_no_motor_s(hold, found):
    """An arm that runs at 1 rad/s stands within the tick from 0.01 s on."""
    q, v = np.tile(ROBOT.neutral, (6, 1)), np.zeros((6, 7))
    v[:2, 1] = 1.0
    run = trace_of(q, v, DT, status=["OK"] * 5)
    assert broken(replace(run, holds=[hold] if hold else [])) == found
