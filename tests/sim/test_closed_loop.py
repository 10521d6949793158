"""Runs of a planner and a plant from start to end, and when faults come and are announced."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.witness import Witness

from ftqp.control.following.path_follower import PathFollower
from ftqp.control.following.stall import StallEscape
from ftqp.control.paths import Circle, Line
from ftqp.control.planner.planner import Planner
from ftqp.control.task.task import Task
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.model import catalog
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import summary
from ftqp.sim.loop import Simulation
from ftqp.sim.schedule import FaultEvent, Schedule, first_tick

DT = 2e-3
AT = 0.6


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
    FreeSwinging("panda_joint3", damping=2.0),
]


@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_arm_of_a_planner_told_at_once_moves_bitwise_as_commanded(panda, path, fault, level):
    plant = Witness(panda, DT, level)
    planner = Planner(panda, dt=DT, level=level, emergency=None)
    schedule = Schedule([FaultEvent(AT, fault)])
    result = Simulation(planner, path, q=panda.neutral, schedule=schedule, plant=plant).run()
    assert plant.differs.max() == 0.0
    assert result.completed or fault.kind == "free_swinging"


def test_log_shows_the_interval_of_the_locked_joint_closed(panda, path, tmp_path):
    schedule = Schedule([FaultEvent(AT, Locked("panda_joint3"))])
    Simulation(
        Planner(panda, dt=DT), path, q=panda.neutral, schedule=schedule, log=tmp_path / "log.npy"
    ).run()
    log = load_log(tmp_path)
    rest = (log["t"] > AT) & (log["v.panda_joint3"] == 0.0)
    assert rest.any()
    np.testing.assert_array_equal(log["lb.panda_joint3"][rest], 0.0)
    np.testing.assert_array_equal(log["ub.panda_joint3"][rest], 0.0)
    np.testing.assert_array_equal(log["tau.panda_joint3"][rest], 0.0)
    assert (log["tau_brake.panda_joint3"][rest] != 0.0).all()


def test_planner_forgets_between_runs_what_this_simulation_told_it(panda, path):
    planner = Planner(panda, dt=DT)
    simulation = Simulation(planner, path, q=panda.neutral, schedule=Schedule([FaultEvent(AT, Locked(2))]))
    first = simulation.run().q
    assert set(planner.faults) == {"panda_joint3"}
    np.testing.assert_array_equal(simulation.run().q, first)


def test_path_led_by_its_progress_ends_when_it_is_done(tmp_path, level):
    robot = catalog.load("panda")
    planner = Planner(robot, 5e-3, level=level, task=Task(mode="scaled"))
    path = Circle(robot.pose(robot.neutral), 0.1, duration=0.6, axes=("y", "z"))
    follower = PathFollower(planner, path)
    result = Simulation(planner, path, q=robot.neutral, follower=follower, log=tmp_path / "log.npy").run()
    log = load_log(tmp_path / "log.npy")
    facts = summary(log)
    assert result.completed and result.progress == 0.6 and result.blocked is None
    assert 0.6 < facts["path_completed_at"] < 1.8 and facts["path_progress"] == 1.0
    assert facts["completed"] and facts["reference"] == "progress" and facts["max_off_path"] < 2e-3
    assert (np.diff(log["progress"]) >= 0.0).all() and log["path_status"][-1] == 5
    assert 2 in log["path_status"], "slowed down somewhere"


def test_blocked_path_ends_the_run_and_says_why(tmp_path):
    robot = catalog.load("planar(4)")
    planner = Planner(robot, 0.01, level="velocity", task=Task(mode="scaled", rows=("x", "y")))
    path = Line(robot.pose(robot.neutral), (0.0, 9.0, 0.0), duration=9.0)
    follower = PathFollower(planner, path, stall=StallEscape(patience=1.0))
    result = Simulation(planner, path, q=robot.neutral, follower=follower, log=tmp_path / "log.npy").run()
    facts = summary(load_log(tmp_path / "log.npy"))
    assert not result.completed and not facts["completed"] and result.steps < 2000
    assert facts["blocked"] == result.blocked and "cannot go on along +y" in result.blocked
    assert facts["path_completed_at"] is None and facts["path_progress"] < 0.5


def test_follower_of_another_planner_is_refused():
    robot = catalog.load("planar(4)")
    one, other = (Planner(robot, 0.01, task=Task(mode="scaled")) for _ in range(2))
    path = Line(robot.pose(robot.neutral), (0.0, -0.1, 0.0), duration=1.0)
    with pytest.raises(InputError, match="leads another planner"):
        Simulation(one, path, q=robot.neutral, follower=PathFollower(other, path))


def test_events_are_sorted_by_time():
    schedule = Schedule([FaultEvent(2.0, Locked("b")), FaultEvent(1.0, Locked("a"))])
    assert [event.at for event in schedule] == [1.0, 2.0]
    assert len(schedule) == 2


@given(st.integers(0, 100_000), st.sampled_from([1e-3, 1e-2, 0.1, 1 / 3]))
def test_a_time_on_a_tick_belongs_to_that_tick_despite_rounding(k, dt):
    assert first_tick(k * dt, dt) == k
    assert first_tick(sum([k * dt / 4] * 4), dt) == k


def test_a_time_between_two_ticks_belongs_to_the_later():
    assert first_tick(0.1001, 0.1) == 2
    assert first_tick(0.0999999999, 0.1) == 1


def test_announcement_is_at_once_later_or_never():
    fault = Locked(0)
    schedule = Schedule(
        [FaultEvent(1.0, fault), FaultEvent(1.0, FreeSwinging(1), 1.5), FaultEvent(1.0, Degraded(2), "never")]
    )
    assert [event.reported_at for event in schedule] == [1.0, 1.5, None]
    assert {k: len(events) for k, events in schedule.failing(0.1).items()} == {10: 3}
    assert {k: [e.fault.joint for e in events] for k, events in schedule.announced(0.1).items()} == {
        10: [0],
        15: [1],
    }


@pytest.mark.parametrize(
    ("at", "announced", "message"),
    [
        (-1.0, None, "time of the fault is -1, expected"),
        (np.nan, None, "time of the fault is nan"),
        (2.0, 1.0, "fault of joint j at 2 s is announced at 1 s, expected no earlier"),
        (2.0, "later", "announcement of the fault is 'later', expected a time in s"),
    ],
)
def test_wrong_times_are_one_clear_sentence(at, announced, message):
    with pytest.raises(InputError, match=message):
        FaultEvent(at, Locked("j"), announced)


def test_the_order_of_earlier_versions_is_understood_with_a_warning():
    new = FaultEvent(1.0, Locked("j"), 1.5)
    for old in (
        lambda: FaultEvent(Locked("j"), 1.0, 1.5),
        lambda: FaultEvent(Locked("j"), at=1.0, announced=1.5),
    ):
        with pytest.warns(DeprecationWarning, match="write FaultEvent"):
            assert old() == new
    assert FaultEvent(fault=Locked("j"), at=1.0, announced=1.5) == new
    with pytest.warns(DeprecationWarning, match="reported_at"):
        assert new.told == new.reported_at == 1.5
