"""Joint servos: first order, rate-limited, and they take what their drive says."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.telescope import telescope

import ftqp
from ftqp.faults.kinds import Locked
from ftqp.model import catalog
from ftqp.sim.plants.servo_plant import ServoPlant

DT = 0.1


@pytest.fixture(scope="module")
def puma():
    return catalog.load("puma560")


@pytest.fixture
def plant(puma):
    made = ServoPlant(puma, DT)
    made.reset(puma.neutral, np.zeros(6))
    return made


def command(v):
    v = np.asarray(v, dtype=float)
    return SimpleNamespace(q=np.full(6, np.nan), v=v)


def test_joint_comes_to_its_set_point_in_first_order(plant, puma):
    plant.advance(command([0.1, 0, 0, 0, 0, 0]))
    np.testing.assert_allclose(plant.q[0] - puma.neutral[0], 0.01 * (1.0 - 0.9**10), rtol=1e-12)
    assert plant.setpoint[0] == pytest.approx(0.01)
    for _ in range(40):
        plant.advance(command(np.zeros(6)))
    np.testing.assert_allclose(plant.q, puma.neutral + np.array([0.01, 0, 0, 0, 0, 0]), atol=1e-12)


def test_rate_limit_lets_the_set_point_run_ahead(plant, puma):
    for _ in range(5):
        plant.advance(command([10.0, 0, 0, 0, 0, 0]))
    assert plant.v[0] == puma.limits.v_max[0]
    np.testing.assert_allclose(plant.q[0] - puma.neutral[0], 0.5 * puma.limits.v_max[0])
    assert plant.setpoint[0] == pytest.approx(5.0)


def test_locked_joint_stands_and_its_set_point_waits(plant, puma):
    plant.fail(Locked("j2"))
    plant.advance(command(np.ones(6)))
    assert plant.q[1] == puma.neutral[1] and plant.v[1] == 0.0 and plant.setpoint[1] == puma.neutral[1]
    assert plant.q[0] > puma.neutral[0]


def test_position_servo_that_is_given_velocities_follows_a_ramp_without_lag(puma):
    made = ServoPlant(puma, 0.001, drive="position")
    late = ServoPlant(puma, 0.001, drive="position", takes_velocity=False)
    v = 0.1
    for k in range(2000):
        ramp = SimpleNamespace(q=puma.neutral + v * 0.001 * (k + 1), v=np.full(6, v))
        made.advance(ramp)
        late.advance(ramp)
    np.testing.assert_allclose(ramp.q - made.q, 0.0, atol=2e-4)
    np.testing.assert_allclose(ramp.q - late.q, v * 0.1, rtol=0.02)  # its time constant


def test_velocity_servo_comes_to_its_velocity_in_first_order_and_keeps_its_limit(puma):
    made = ServoPlant(puma, 0.001, drive="velocity", substeps=100)
    for k in range(300):
        made.advance(SimpleNamespace(q=np.full(6, np.nan), v=np.array([0.1, 10.0, 0, 0, 0, 0])))
        if k == 99:
            np.testing.assert_allclose(made.v[0], 0.1 * (1.0 - np.exp(-1.0)), rtol=1e-3)
    assert made.v[1] == puma.limits.v_max[1]


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_planner_of_the_same_drive_brings_the_tip_round_a_circle(drive, level):
    panda = catalog.load("panda")
    planner = ftqp.Planner(panda, 0.002, drive=drive, level=level)
    path = ftqp.paths.Circle(panda.pose(panda.neutral), 0.1, duration=3.0)
    plant = ServoPlant(panda, 0.002, drive=drive, time_constant=0.03)
    result = ftqp.Simulation(planner, path, q=panda.neutral, plant=plant, duration=4.0).run()
    assert result.final_status is ftqp.StepStatus.OK and result.stopped_at is None
    assert np.linalg.norm(panda.pose(plant.q)[:3, 3] - path.start[:3, 3]) < 1e-3
    assert np.abs(plant.v).max() < 1e-2


@pytest.mark.parametrize("drive", ["position", "velocity", None])
def test_a_joint_that_mimics_another_goes_and_stands_with_it(drive):
    robot = ftqp.Robot.from_urdf(telescope(), "tool")
    chain = robot.chain
    plant = ServoPlant(robot, 0.01, drive=drive)
    q = chain.ratio * robot.neutral[chain.lead] + chain.offset
    plant.reset(q, np.zeros(8))
    v = np.full(8, 0.05)
    for k in range(40):
        if k == 20:
            plant.fail(Locked("elbow"))
            stood = plant.q.copy()
        q = q + 0.01 * v
        plant.advance(SimpleNamespace(q=q, v=v))
        assert plant.q == pytest.approx(chain.ratio * plant.q[chain.lead] + chain.offset, abs=1e-15)
        assert plant.v == pytest.approx(chain.ratio * plant.v[chain.lead], abs=1e-15)
    assert plant.q[[3, 4]] == pytest.approx(stood[[3, 4]], abs=1e-15) and plant.q[0] > stood[0]
    plant.repair("elbow")
    plant.advance(SimpleNamespace(q=q, v=v))
    assert plant.q[3] > stood[3]
