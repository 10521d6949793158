from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from ftqp.control.paths import Circle
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.target import Target
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.loop import MEMORY, Simulation
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.schedule import FaultEvent, Schedule

DT = 1e-2


def command(plant, a, level="acceleration"):
    v = plant.v + DT * a
    q = plant.q + DT * plant.v + 0.5 * DT**2 * a if level == "acceleration" else plant.q + DT * v
    return SimpleNamespace(q=q, v=v)


@pytest.fixture
def plant(panda):
    plant = KinematicPlant(panda, DT)
    plant.reset(panda.neutral, np.linspace(-0.3, 0.4, 7))
    return plant


def test_healthy_arm_does_bitwise_what_it_is_told(plant):
    step = command(plant, np.linspace(1.0, -1.0, 7))
    plant.advance(step)
    np.testing.assert_array_equal(plant.q, step.q)
    np.testing.assert_array_equal(plant.v, step.v)


def test_locked_joint_brakes_whatever_it_is_told_then_stays_bitwise(panda, level):
    plant = KinematicPlant(panda, DT, level)
    plant.reset(panda.neutral, np.full(7, 0.2))
    plant.fail(Locked(2, deceleration=3.0))
    speeds, places = [plant.v[2]], [plant.q[2]]
    for _ in range(20):
        plant.advance(command(plant, np.full(7, 1.0), level))
        speeds.append(plant.v[2])
        places.append(plant.q[2])
    np.testing.assert_allclose(speeds[:7], [0.2, 0.17, 0.14, 0.11, 0.08, 0.05, 0.02], atol=1e-12)
    assert speeds[7:] == [0.0] * 14
    assert len(set(places[7:])) == 1
    travelled = 0.2**2 / (2 * 3.0) if level == "acceleration" else DT * sum(speeds[1:])
    assert places[-1] - places[0] == pytest.approx(travelled, abs=1e-4)
    assert plant.v[1] == pytest.approx(0.4)


def test_brake_belongs_to_the_arm_unless_the_fault_names_a_deceleration(panda):
    plant = KinematicPlant(panda, DT, brake=0.5)
    plant.reset(panda.neutral, np.full(7, 2.0))
    plant.fail(Locked(1))
    plant.fail(Locked(2, deceleration=3.0))
    plant.advance(command(plant, np.zeros(7)))
    assert plant.v[1] == pytest.approx(2.0 - 0.5 * panda.limits.a_max[1] * DT)
    assert plant.v[2] == pytest.approx(2.0 - 3.0 * DT)
    with pytest.raises(InputError, match="brake is 0, expected a finite number > 0"):
        KinematicPlant(panda, DT, brake=0.0)


def test_joint_locked_instantly_stops_at_once(plant):
    plant.fail(Locked(0, mode="instant"))
    before = plant.q[0]
    assert plant.v[0] == 0.0
    plant.advance(command(plant, np.ones(7)))
    assert (plant.q[0], plant.v[0]) == (before, 0.0)


@pytest.mark.parametrize("reset", ["momentum", "task"])
def test_planner_still_sees_the_velocity_that_its_reset_needs(plant, reset):
    plant.fail(Locked(0, mode="instant", reset=reset))
    before = plant.q[0]
    assert plant.v[0] == -0.3
    plant.advance(command(plant, np.ones(7)))
    assert (plant.q[0], plant.v[0]) == (before, 0.0)


@pytest.mark.parametrize(("own", "error"), [(0.0, 1e-9), (400.0, 1e-8)])
def test_free_swinging_joint_has_no_motor_torque_but_friction_and_keeps_its_own(panda, own, error):
    """400: as strong as none could be that was taken at the velocity before the step."""
    arm = KinematicPlant(panda.with_friction(viscous=own), DT)
    arm.reset(panda.neutral, np.linspace(-0.3, 0.4, 7))
    arm.fail(FreeSwinging(1, damping=0.7))
    arm.fail(FreeSwinging(5, damping=0.2))
    q, v = arm.q.copy(), arm.v.copy()
    arm.advance(command(arm, np.linspace(0.5, -0.5, 7)))
    a = (arm.v - v) / DT
    tau = pin.rnea(panda.model, panda.model.createData(), q, v, a)
    np.testing.assert_allclose(tau[[1, 5]], -(own + np.array([0.7, 0.2])) * arm.v[[1, 5]], atol=error)
    np.testing.assert_allclose(arm.q, q + DT * v + 0.5 * DT**2 * a, atol=1e-12)
    assert own == 0.0 or abs(arm.v[5]) < abs(v[5])


def test_pendulum_without_friction_keeps_its_energy(panda):
    plant = KinematicPlant(panda, 1e-4)
    plant.reset(panda.neutral, np.zeros(7))
    plant.fail(FreeSwinging(3))
    data = panda.model.createData()

    def energy():
        return pin.computeKineticEnergy(panda.model, data, plant.q, plant.v) + pin.computePotentialEnergy(
            panda.model, data, plant.q
        )

    first = energy()
    for _ in range(1800):  # not as far as its end stop
        plant.advance(SimpleNamespace(q=plant.q.copy(), v=np.zeros(7)))
    assert pin.computeKineticEnergy(panda.model, data, plant.q, plant.v) > 1.0
    assert energy() == pytest.approx(first, abs=1e-2)


def fallen(panda, **settings):
    """A plant whose fourth joint has fallen for a second, the others held."""
    plant = KinematicPlant(panda, DT, **settings)
    plant.reset(panda.neutral, np.zeros(7))
    plant.fail(FreeSwinging(3))
    for _ in range(round(1.0 / DT)):
        plant.advance(SimpleNamespace(q=plant.q.copy(), v=np.zeros(7)))
    return plant


@pytest.mark.parametrize("distance", [0.0, 0.01])
def test_free_swinging_joint_stays_at_the_stop_that_it_meets_once(panda, distance):
    plant = fallen(panda, stop_distance=distance)
    assert plant.q[3] == panda.limits.q_min[3] - distance and plant.v[3] == 0.0
    (hit,) = plant.impacts
    assert hit.joint == "panda_joint4" and 0.1 < hit.time < 1.0 and hit.speed > 1.0
    plant.reset(panda.neutral, np.zeros(7))
    assert plant.impacts == ()


def test_coulomb_friction_holds_a_free_swinging_joint(panda):
    plant = KinematicPlant(panda, DT)
    plant.reset(panda.neutral, np.zeros(7))
    plant.fail(FreeSwinging(3, friction=100.0))
    plant.advance(SimpleNamespace(q=plant.q.copy(), v=np.zeros(7)))
    assert plant.v[3] == 0.0 and plant.q[3] == panda.neutral[3]


def test_degraded_joint_saturates_at_what_is_left(plant, panda):
    plant.reset(panda.neutral, np.zeros(7))
    plant.fail(Degraded(4, velocity=0.1, acceleration=0.5))
    top, a_max = 0.1 * panda.limits.v_max[4], 0.5 * panda.limits.a_max[4]
    last = 0.0
    for _ in range(200):
        plant.advance(command(plant, np.where(np.arange(7) == 4, 10.0 * a_max, 0.0)))
        assert plant.v[4] <= last + DT * a_max + 1e-12
        assert plant.v[4] <= top
        last = plant.v[4]
    assert last == pytest.approx(top)


def test_degraded_joint_that_is_too_fast_slows_down_at_what_is_left(plant, panda):
    fast = panda.limits.v_max[4]
    plant.reset(panda.neutral, np.where(np.arange(7) == 4, fast, 0.0))
    plant.fail(Degraded(4, velocity=0.1, acceleration=0.5))
    plant.advance(command(plant, np.zeros(7)))
    assert plant.v[4] == pytest.approx(fast - DT * 0.5 * panda.limits.a_max[4])


def test_degraded_joint_stops_at_the_end_of_what_is_left_of_its_range(plant, panda):
    plant.reset(panda.neutral, np.where(np.arange(7) == 0, 1.0, 0.0))
    end = panda.neutral[0] + 0.05
    plant.fail(Degraded(0, q_max=end))
    for _ in range(20):
        plant.advance(command(plant, np.where(np.arange(7) == 0, 1.0, 0.0)))
    assert (plant.q[0], plant.v[0]) == (end, 0.0)


def test_reset_makes_the_arm_healthy(plant, panda):
    plant.fail(Locked(0, mode="instant"))
    plant.reset(panda.neutral, np.full(7, 0.1))
    plant.advance(command(plant, np.zeros(7)))
    assert plant.v[0] == 0.1


def test_unknown_joint_and_missing_inertia_are_clear_sentences(plant, panda):
    with pytest.raises(InputError, match="'j9' is not a joint of panda"):
        plant.fail(Locked("j9"))
    bare = type(panda).from_pinocchio(panda.model, panda.tip, kinematics_only=True)
    with pytest.raises(InputError, match="has no inertia, so the motion of free-swinging panda_joint1"):
        KinematicPlant(bare, DT).fail(FreeSwinging(0))
    with pytest.raises(InputError, match="'torque' is not a level of a plant"):
        KinematicPlant(panda, DT, "torque")


@pytest.mark.parametrize("speed", [1.0, -1.0, 0.2])
def test_joint_that_locks_before_its_limit_brakes_as_an_informed_planner_believes(panda, level, speed):
    """Bit by bit: the ramp that the room asks for is the same on both sides."""
    limits = panda.limits
    q, v = panda.neutral.copy(), np.zeros(7)
    v[2] = speed
    q[2] = (limits.q_max[2] - 0.06) if speed > 0.0 else limits.q_min[2] + 0.06
    plant, planner = KinematicPlant(panda, DT, level), Planner(panda, DT, level=level, emergency=None)
    plant.reset(q, v)
    planner.reset(q, v)
    plant.fail(Locked(2))
    planner.report(Locked(2))
    target = Target(pose=panda.pose(q))
    for _ in range(200):
        step = planner.step(plant.q, plant.v, target)
        plant.advance(step)
        assert plant.q[2] == step.q[2] and plant.v[2] == step.v[2]
        assert limits.q_min[2] <= plant.q[2] <= limits.q_max[2]
    assert plant.v[2] == 0.0


def test_locked_joint_stays_where_it_is_while_its_command_is_elsewhere(panda):
    # a planner that is told late sends it elsewhere meanwhile
    planner = Planner(panda, 0.01, level="velocity")
    schedule = Schedule([FaultEvent(0.3, Locked(3, mode="instant"), announced=0.45)])
    path = Circle(panda.pose(panda.neutral), 0.1, duration=1.0)
    made = Simulation(planner, path, q=panda.neutral, schedule=schedule, duration=1.5, log=MEMORY)
    log = made.run().log
    t = log["t"]
    assert len(set(log["q.panda_joint4"][t > 0.305])) == 1
    assert len(set(log["q.panda_joint4"][t < 0.305])) > 20
