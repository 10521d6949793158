"""What holds across the whole, whatever the solver.

The planner cannot peek, it repeats itself, and it forgets repaired faults.
"""

from graphlib import TopologicalSorter
from pathlib import Path

import grimp
import numpy as np
import pytest
from bench.wrapped_plant import WrappedPlant

import ftqp
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.schedule import FaultEvent, Schedule

DT = 2e-3
AT = 0.5
PANDA = ftqp.robots.load("panda")
BACKEND_TOLERANCE = 1e-6
"""By how much the commands of two backends may differ [rad/s2, or rad/s], one number for all."""
FAULTS = [
    ftqp.Locked("panda_joint3"),
    ftqp.Locked("panda_joint5", mode="instant"),
    ftqp.FreeSwinging("panda_joint7", damping=1.0),
    ftqp.Degraded("panda_joint2", velocity=0.02, acceleration=0.2, torque=0.9),
]


class Recorder(WrappedPlant):
    """A kinematic arm that keeps every command, bit by bit, and may hide its failures from its own motion."""

    def __init__(self, level, honest=True):
        super().__init__(KinematicPlant(PANDA, DT, level))
        self._honest = honest
        self.commands = []

    def fail(self, fault):
        if self._honest:
            self._plant.fail(fault)

    def advance(self, command):
        self.commands.append((command.q.tobytes(), command.v.tobytes(), command.a.tobytes()))
        self._plant.advance(command)


def commands(level, schedule=(), honest=True, scheme="mvn", backend="active_set"):
    planner = ftqp.Planner(PANDA, DT, level=level, scheme=scheme, backend=backend)
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=1.0, axes=("y", "z"))
    plant = Recorder(level, honest)
    Simulation(planner, path, q=PANDA.neutral, schedule=Schedule(schedule), plant=plant).run()
    return plant.commands


@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_scheduled_fault_changes_nothing_before_it_happens(level, fault):
    k = round(AT / DT)
    healthy, failing = commands(level), commands(level, [FaultEvent(AT, fault)])
    assert failing[:k] == healthy[:k]
    assert failing[k:] != healthy[k:]


@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_fault_that_is_not_announced_yet_is_known_by_its_motion_only(level, fault):
    """The arm hides the fault until the announcement: up to then every command is that of a healthy arm."""
    k = round(0.6 / DT)
    healthy = commands(level)
    told_late = commands(level, [FaultEvent(AT, fault, announced=0.6)], honest=False)
    never_told = commands(level, [FaultEvent(AT, fault, announced="never")], honest=False)
    assert told_late[:k] == healthy[:k] and told_late[k:] != healthy[k:]
    assert never_told == healthy


def test_planner_and_its_beliefs_cannot_import_the_simulation():
    graph = grimp.build_graph("ftqp")
    below = {
        m
        for m in graph.modules
        if m.startswith(("ftqp.control", "ftqp.faults", "ftqp.kernel", "ftqp.qp", "ftqp.model"))
    }
    above = {m for m in graph.modules if m.startswith(("ftqp.sim", "ftqp.analysis", "ftqp.viz", "ftqp.app"))}
    assert "ftqp.control.planner.planner" in below and "ftqp.sim.schedule" in above
    assert not {(a, b) for a in below for b in graph.find_modules_directly_imported_by(a) if b in above}
    assert graph.find_shortest_chain("ftqp.control.planner.planner", "ftqp.sim.schedule") is None


def test_imports_go_round_in_no_circle():
    """Those inside functions and those for type checkers count; none waits for an optional package."""
    graph = grimp.build_graph("ftqp")
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert "ftqp.app.study.dask_cluster" in imported["ftqp.app.study.runner"]  # which a function imports
    assert len(list(TopologicalSorter(imported).static_order())) == len(imported) > 400


def test_planner_reads_no_clock_into_its_command_and_draws_no_unseeded_number():
    source = Path(ftqp.__file__).parent
    for folder in ("kernel", "faults", "control"):
        for file in (source / folder).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            assert "import time\n" not in text and "from time " not in text, file
            assert "default_rng()" not in text and "np.random.seed" not in text, file


@pytest.mark.parametrize("scheme", ["mvn", "dlsm"])
def test_same_input_gives_the_same_output(level, scheme):
    schedule = [FaultEvent(AT, FAULTS[0])]
    assert commands(level, schedule, scheme=scheme) == commands(level, schedule, scheme=scheme)


@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_arm_that_is_repaired_is_a_healthy_arm(level, fault):
    generator = np.random.default_rng(7)
    repaired, healthy = (ftqp.Planner(PANDA, DT, level=level, emergency=None) for _ in range(2))
    for planner in (repaired, healthy):
        planner.reset(PANDA.neutral)
    repaired.report(fault)
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    for _ in range(10):
        repaired.step(PANDA.neutral, np.zeros(7), target)
    repaired.withdraw(fault.joint)
    for planner in (repaired, healthy):  # what the fault has made of the arm's motion is another matter
        planner.reset(PANDA.neutral)
    for _ in range(50):
        q, v = PANDA.neutral + generator.uniform(-0.2, 0.2, 7), generator.uniform(-0.2, 0.2, 7)
        target.pose[:] = PANDA.pose(q + generator.uniform(-0.02, 0.02, 7))
        a, b = repaired.step(q, v, target), healthy.step(q, v, target)
        assert a.status is b.status
        np.testing.assert_allclose(a.v, b.v, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(a.a, b.a, rtol=1e-9, atol=1e-9 / DT)


@pytest.mark.solvers
def test_all_backends_agree_with_one_tolerance(level):
    """At the same states, through a fault, on a task that the arm can follow."""
    names = ["active_set", "dtrnn", "daqp", "quadprog", "proxqp", "osqp"]
    planners = [ftqp.Planner(PANDA, DT, level=level, backend=name) for name in names]
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.05, duration=1.2, axes=("y", "z"))
    sample = path.sample(np.arange(600) * DT)
    q, v = PANDA.neutral.copy(), np.zeros(7)
    target = ftqp.Target(pose=path.start)
    for planner in planners:
        planner.reset(q)
    for k in range(600):
        if k == 300:
            for planner in planners:
                planner.report(ftqp.Locked(2))
        target.pose[:], target.twist[:] = sample.pose[k], sample.twist[k]
        target.acceleration[:] = sample.acceleration[k]
        steps = [planner.step(q, v, target) for planner in planners]
        x = np.array([s.a if level == "acceleration" else s.v for s in steps])
        assert len({s.status for s in steps}) == 1
        assert np.ptp(x, axis=0).max() <= BACKEND_TOLERANCE
        q, v = steps[0].q.copy(), steps[0].v.copy()
