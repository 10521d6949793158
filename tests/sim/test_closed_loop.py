"""The loop around the real planner."""

import numpy as np
import pytest

from ftqp.control.paths import Circle
from ftqp.control.planner import Planner
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.log import load_log
from ftqp.sim.loop import Simulation
from ftqp.sim.metrics import summary
from ftqp.sim.plants import KinematicPlant, Plant
from ftqp.sim.schedule import FaultEvent, Schedule

DT = 2e-3
AT = 0.6


class Witness(Plant):
    """A kinematic plant that keeps by how much it differs from what it was told."""

    def __init__(self, *args):
        self._plant = KinematicPlant(*args)
        self.differs = []

    @property
    def q(self):
        return self._plant.q

    @property
    def v(self):
        return self._plant.v

    def reset(self, q, v):
        self._plant.reset(q, v)

    def fail(self, fault):
        self._plant.fail(fault)

    def advance(self, command):
        q, v = command.q.copy(), command.v.copy()
        self._plant.advance(command)
        self.differs.append(max(np.abs(self.q - q).max(), np.abs(self.v - v).max()))


@pytest.fixture
def path(start):
    return Circle(start, 0.05, duration=1.5, axes=("y", "z"))


FAULTS = [
    Locked("panda_joint3"),
    Locked("panda_joint3", deceleration=0.2),
    Locked("panda_joint3", mode="instant"),
    Locked("panda_joint3", mode="instant", reset="momentum"),
    Locked("panda_joint3", mode="instant", reset="task"),
    Degraded("panda_joint4", velocity=0.3, acceleration=0.5, torque=0.9),
]


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_arm_of_a_planner_told_at_once_moves_bitwise_as_commanded(panda, path, fault, level):
    plant = Witness(panda, DT, level)
    planner = Planner(panda, dt=DT, level=level)
    schedule = Schedule([FaultEvent(fault, AT)])
    result = Simulation(planner, path, q=panda.neutral, schedule=schedule, plant=plant).run()
    assert max(plant.differs) == 0.0
    assert result.completed


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_free_swinging_joint_of_a_planner_told_at_once_moves_as_commanded(panda, path, level):
    plant = Witness(panda, DT, level)
    planner = Planner(panda, dt=DT, level=level, emergency=None)
    schedule = Schedule([FaultEvent(FreeSwinging("panda_joint3", damping=2.0), AT)])
    Simulation(planner, path, q=panda.neutral, schedule=schedule, plant=plant).run()
    assert max(plant.differs) == 0.0


def test_tip_follows_the_path_through_a_locked_joint(panda, path, tmp_path):
    schedule = Schedule([FaultEvent(Locked("panda_joint3"), AT)])
    planner = Planner(panda, dt=DT)
    Simulation(planner, path, q=panda.neutral, schedule=schedule, log=tmp_path / "log.sqlite").run()
    result = summary(load_log(tmp_path))
    assert result["completed"]
    assert result["max_position_error"] < 2e-4
    assert result["max_limit_violation"] == {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0}
    assert result["max_failed_joint_motion"] == {"panda_joint3": 0.0}
    assert result["qp"]["failures"] == 0
    assert result["scheme"] == "mvn"


def test_log_shows_the_interval_of_the_locked_joint_closed(panda, path, tmp_path):
    schedule = Schedule([FaultEvent(Locked("panda_joint3"), AT)])
    Simulation(
        Planner(panda, dt=DT), path, q=panda.neutral, schedule=schedule, log=tmp_path / "log.sqlite"
    ).run()
    log = load_log(tmp_path)
    rest = (log["t"] > AT) & (log["v.panda_joint3"] == 0.0)
    assert rest.any()
    np.testing.assert_array_equal(log["lb.panda_joint3"][rest], 0.0)
    np.testing.assert_array_equal(log["ub.panda_joint3"][rest], 0.0)
    np.testing.assert_array_equal(log["tau.panda_joint3"][rest], 0.0)
    assert (log["tau_brake.panda_joint3"][rest] != 0.0).all()


def test_fault_that_is_never_told_shows_in_the_error(panda, path):
    results = {}
    for announced in (None, "never"):
        plant = KinematicPlant(panda, DT)
        planner = Planner(panda, dt=DT, emergency=None)
        schedule = Schedule([FaultEvent(Locked("panda_joint3"), AT, announced)])
        Simulation(planner, path, q=panda.neutral, schedule=schedule, plant=plant).run()
        results[announced] = np.linalg.norm((panda.pose(plant.q) - path.sample(path.duration).pose[0])[:3, 3])
    assert results[None] < 1e-4
    assert results["never"] > 1e-3


def test_planner_forgets_between_runs_what_this_simulation_told_it(panda, path):
    planner = Planner(panda, dt=DT)
    simulation = Simulation(planner, path, q=panda.neutral, schedule=Schedule([FaultEvent(Locked(2), AT)]))
    first = simulation.run().q
    assert set(planner.faults) == {"panda_joint3"}
    np.testing.assert_array_equal(simulation.run().q, first)
