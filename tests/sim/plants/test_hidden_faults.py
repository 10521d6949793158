"""What befalls joints in physics without anybody knowing of it."""

from types import SimpleNamespace

import numpy as np
import pytest

import ftqp

pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')

from ftqp.sim.plants.troubled_plant import Jammed, Misread, Runaway, Weakened

DT = 1e-3
START = np.array([0.0, -0.785398, 0.0, -2.356194, 0.0, 1.570796, 0.785398])
JOINT = 3
SPEED = 0.3


def command(q, v, brakes=()):
    asked = np.zeros(len(q), dtype=bool)
    asked[list(brakes)] = True
    return SimpleNamespace(q=q, v=v, tau=np.zeros(len(q)), brakes=asked)


def waved(plant, ticks=300, happens=None, at=150, brakes=()):
    """Every joint is led along a sine: true q, tau and demand at the start of each tick, (K, 3, nv)."""
    plant.reset(START, np.full(7, SPEED))
    seen = np.zeros((ticks, 3, 7))
    for k in range(ticks):
        if k == at and happens is not None:
            happens(plant)
        seen[k] = plant.q, plant.tau, plant.demand
        t = (k + 1) * DT
        q, v = START + SPEED / 8.0 * np.sin(8.0 * t), np.full(7, SPEED * np.cos(8.0 * t))
        plant.advance(command(q, v, brakes if k >= at else ()))
    return seen


@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_log_of_torques_does_not_know_of_a_fault_that_changes_nothing(panda, drive):
    plant = ftqp.MujocoPlant(panda, DT, ftqp.JointServo(panda, drive))
    healthy = waved(plant)
    odd = waved(plant, happens=lambda arm: arm.suffer(Weakened(JOINT, 1.0)))
    np.testing.assert_array_equal(healthy, odd)
    steps = np.abs(np.diff(healthy[100:, 1:], axis=0)).max(axis=(1, 2))
    assert steps[49] < 1.5 * np.median(steps)  # tick 150 is no more than any other


@pytest.mark.parametrize(
    "happens",
    [
        lambda arm: arm.fail(ftqp.Locked(JOINT)),
        lambda arm: arm.suffer(Jammed(JOINT)),
        lambda arm: arm.suffer(Runaway(JOINT)),
        lambda arm: arm.suffer(Weakened(JOINT, 0.5)),
        lambda arm: arm.suffer(Misread(JOINT, bias=0.02)),
    ],
)
def test_log_of_torques_shows_a_fault_a_tick_after_it_has_happened(panda, happens):
    plant = ftqp.MujocoPlant(panda, DT)
    healthy, failed = waved(plant), waved(plant, happens=happens)
    np.testing.assert_array_equal(healthy[:151], failed[:151])
    assert (healthy[151] != failed[151]).any()


def test_runaway_joint_has_all_its_torque_in_its_direction_until_a_brake_is_asked_for(panda):
    for direction in (-1, 1):
        plant = ftqp.MujocoPlant(panda, DT)
        healthy, seen = (
            waved(plant, 200, happens)
            for happens in (None, lambda arm, d=direction: arm.suffer(Runaway(JOINT, d)))
        )
        assert (seen[151:, 1, JOINT] == direction * panda.limits.tau_max[JOINT]).all()
        assert direction * (seen[190, 0, JOINT] - healthy[190, 0, JOINT]) > 0.02
    plant = ftqp.MujocoPlant(panda, DT)
    braked = waved(plant, 400, lambda arm: arm.suffer(Runaway(JOINT, 1)), brakes=[JOINT])
    assert np.ptp(braked[200:, 0, JOINT]) < 1e-4
    assert (braked[151:, 1, JOINT] == 0.0).all()


def test_weakened_motor_gives_its_share_of_every_demand(panda):
    seen = waved(ftqp.MujocoPlant(panda, DT), happens=lambda arm: arm.suffer(Weakened(JOINT, 0.5)))
    np.testing.assert_allclose(seen[151:, 1, JOINT], 0.5 * seen[151:, 2, JOINT], rtol=1e-12)
    others = np.arange(7) != JOINT
    np.testing.assert_array_equal(seen[:, 1, others], seen[:, 2, others])


def test_motor_of_a_jammed_joint_pushes_where_that_of_a_locked_one_is_off(panda):
    jammed = waved(ftqp.MujocoPlant(panda, DT), happens=lambda arm: arm.suffer(Jammed(JOINT)))
    locked = waved(ftqp.MujocoPlant(panda, DT), happens=lambda arm: arm.fail(ftqp.Locked(JOINT)))
    for seen in (jammed, locked):
        assert np.ptp(seen[200:, 0, JOINT]) < 1e-4
    assert (locked[151:, 1, JOINT] == 0.0).all() and np.abs(jammed[200:, 1, JOINT]).max() > 20.0


def test_servo_follows_what_its_encoder_says(panda):
    plant = ftqp.MujocoPlant(panda, DT)
    healthy = waved(plant, 400)
    biased = waved(plant, 400, lambda arm: arm.suffer(Misread(JOINT, bias=0.02)))
    assert biased[-1, 0, JOINT] - healthy[-1, 0, JOINT] == pytest.approx(-0.02, abs=1e-3)
    frozen = waved(plant, 250, lambda arm: arm.suffer(Misread(JOINT, frozen=True)))
    assert abs(frozen[-1, 0, JOINT] - healthy[249, 0, JOINT]) > 0.05  # nothing tells it that it is there


@pytest.mark.parametrize("fault", [Runaway(JOINT), Weakened(JOINT, 0.0), Misread(JOINT, bias=0.1)])
def test_what_befell_a_joint_is_over_with_its_next_fault_and_with_a_reset(panda, fault):
    plant = ftqp.MujocoPlant(panda, DT)

    def twice(arm):
        arm.suffer(fault)
        arm.fail(ftqp.Degraded(JOINT))

    np.testing.assert_array_equal(waved(plant, 200), waved(plant, 200, twice))
    plant.suffer(fault)
    np.testing.assert_array_equal(waved(ftqp.MujocoPlant(panda, DT), 200), waved(plant, 200))


def test_torque_arm_has_no_servo_to_mislead(panda):
    plant = ftqp.MujocoPlant(panda, DT, ftqp.JointServo(panda, "torque"))
    with pytest.raises(ftqp.InputError, match="no servo that could misread"):
        plant.suffer(Misread(JOINT, bias=0.1))
    with pytest.raises(ftqp.InputError, match="panda_joint4"):
        plant.suffer(Jammed("panda_joint44"))
    with pytest.raises(ftqp.InputError, match="fault is of type Degraded, expected Runaway"):
        plant.suffer(ftqp.Degraded(JOINT))
