"""The network in the loop: the active set's motion; a warm start in the record that dies with a fault."""

import numpy as np
import pytest

import ftqp
from ftqp.control.planner.filling import filled
from ftqp.control.planner.solver.dtrnn_memory import network_memory
from ftqp.control.task.bounds import Viability
from ftqp.kernel.compiled import kernel
from ftqp.qp.problem import SolveStatus

DT = 1e-3


def entries_asked_for(monkeypatch):
    """Names of the kernel's entry points that sessions ask for from now on."""
    asked = []

    def load(entry, capacity):
        asked.append(entry.name)
        return kernel.load(entry, capacity)

    monkeypatch.setattr("ftqp.kernel.entry.session.load", load)
    return asked


def follow(planner, path, ticks, fault=None, at=None, q=None):
    """Closed loop over ``ticks``: configurations, statuses, iterations."""
    q = planner.robot.neutral.copy() if q is None else np.array(q)
    v = np.zeros(planner.robot.nv)
    planner.reset(q)
    samples = path.sample(np.arange(ticks) * planner.dt)
    target = ftqp.Target(pose=path.start)
    rows, status, iterations = [], [], []
    for k in range(ticks):
        if k == at:
            planner.report(fault)
        target.pose[:], target.twist[:] = samples.pose[k], samples.twist[k]
        target.acceleration[:] = samples.acceleration[k]
        step = planner.step(q, v, target)
        q, v = step.q.copy(), step.v.copy()
        rows.append(q)
        status.append(step.status)
        iterations.append(step.qp.iterations)
    return np.array(rows), status, np.array(iterations)


def test_the_network_runs_in_the_kernel(panda, monkeypatch):
    asked = entries_asked_for(monkeypatch)
    assert ftqp.Planner(panda, backend="dtrnn").backend == "dtrnn"
    ftqp.Planner(panda)
    assert "network_clock" in asked and "step" in asked


def test_a_lost_joint_on_a_circle_makes_the_motion_of_the_active_set(panda, home, level):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint3")
    runs = [follow(ftqp.Planner(panda, DT, level=level, backend=name), path, 2000, fault, 1000)
            for name in ("active_set", "dtrnn")]  # fmt: skip
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-6
    assert np.median(runs[1][2]) <= 1


@pytest.mark.parametrize("mode", ["slack", "hard", "scaled", "lexicographic"])
def test_a_task_out_of_reach_ends_in_the_same_status_in_every_mode(panda, home, mode):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint4")
    settings = dict(emergency=None, task=ftqp.Task(mode=mode))
    runs = [
        follow(ftqp.Planner(panda, DT, backend=name, **settings), path, 1200, fault, 1000)
        for name in ("active_set", "dtrnn")
    ]
    assert ftqp.StepStatus.RELAXED in runs[0][1]
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-5


@pytest.mark.parametrize("method", ["94lvi", "e47"])
def test_an_explicit_method_keeps_the_task_too(panda, home, method):
    path = ftqp.paths.Circle(home, 0.05, duration=1.0, axes=("y", "z"))
    planner = ftqp.Planner(panda, DT, backend={"name": "dtrnn", "method": method})
    reference, found = follow(ftqp.Planner(panda, DT), path, 300), follow(planner, path, 300)
    assert reference[1] == found[1]
    assert np.abs(reference[0] - found[0]).max() <= 1e-6


def test_a_free_swinging_joint_and_torque_rows_are_kept(panda, home):
    path = ftqp.paths.Circle(home, 0.02, duration=2.0, axes=("x", "y"))
    runs = [follow(ftqp.Planner(panda, DT, backend=name, emergency=None), path, 300,
                   ftqp.FreeSwinging("panda_joint7", damping=0.5), 100)
            for name in ("active_set", "dtrnn")]  # fmt: skip
    assert runs[0][1] == runs[1][1]
    assert np.abs(runs[0][0] - runs[1][0]).max() <= 1e-6


class TestWarmStart:
    """It is carried from tick to tick, and dropped by whatever makes it another problem's."""

    def planner(self, panda, home, **settings):
        self.target = ftqp.Target(pose=home)
        self.target.position[0] += 0.02
        self.q, self.v = panda.neutral.copy(), np.zeros(7)
        task = ftqp.Task(calm=False)  # in calm the network would not be asked
        network = {"name": "dtrnn", **settings}
        planner = ftqp.Planner(panda, DT, scheme="dlsm", task=task, backend=network)
        planner.reset(self.q)
        return planner

    def put_back(self, planner):
        """The arm is where it was, and nothing else is forgotten."""
        K = planner._session.K
        K.gate.q[:7], K.gate.v[:7], K.gate.sent[:7] = self.q, self.v, self.q
        K.feedback.fresh = 1

    def step(self, planner):
        """The same problem again."""
        self.put_back(planner)
        step = planner.step(self.q, self.v, self.target)
        assert step.status is ftqp.StepStatus.LAGGING and step.qp.status is SolveStatus.SOLVED
        return step.qp.iterations

    def test_it_is_carried(self, panda, home):
        planner = self.planner(panda, home, mode="paper", scaling=True)
        cold = self.step(planner)
        assert cold > 5
        assert self.step(planner) < cold / 2  # the same problem again

    @pytest.mark.parametrize("change", ["report", "withdraw", "reset"])
    def test_it_is_dropped_by(self, panda, home, change):
        planner = self.planner(panda, home, mode="paper", scaling=True)
        if change == "withdraw":
            planner.report(ftqp.Degraded(2, velocity=0.9))
        cold = self.step(planner)
        warm = self.step(planner)
        if change == "report":
            planner.report(
                ftqp.Degraded(2, velocity=0.9)
            )  # no bound that matters changes: only the start does
        elif change == "withdraw":
            planner.withdraw(2)
        else:
            planner.reset(self.q)
        assert self.step(planner) == cold > warm

    def test_it_is_dropped_by_a_tick_without_a_solved_task(self, panda, home):
        planner = self.planner(panda, home, mode="paper", scaling=True)
        cold, warm = self.step(planner), self.step(planner)
        broken = self.target.packed.copy()
        self.target.twist[0] = np.nan
        bad = planner.step(self.q, self.v, self.target)
        self.target.packed[:] = broken
        assert bad.status is ftqp.StepStatus.INVALID_INPUT
        assert self.step(planner) == cold > warm
        assert self.step(planner) == warm

    def test_a_lock_is_no_start_for_the_arm_before_it(self, panda, home):
        warm, cold = self.planner(panda, home), self.planner(panda, home)
        self.step(warm)
        for planner in (warm, cold):
            self.put_back(planner)
            planner.report(ftqp.Locked(2))
        a, b = (planner.step(self.q, self.v, self.target).a.copy() for planner in (warm, cold))
        np.testing.assert_array_equal(a, b)


def test_steps_are_deterministic(panda, home):
    path = ftqp.paths.Circle(home, 0.1, duration=1.0, axes=("x", "y"))
    runs = [follow(ftqp.Planner(panda, DT, backend="dtrnn"), path, 200, ftqp.Locked(1), 100)[0]
            for _ in range(2)]  # fmt: skip
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize(("mode", "accepted"), [("product", 1e-6), ("paper", 1e-4)])
def test_an_answer_is_accepted_at_the_tolerance_of_its_mode(panda, mode, accepted):
    criterion = ftqp.schemes.mvn().at("acceleration")
    session = filled(panda, ftqp.Task(), criterion, Viability(), None, level="acceleration", dt=DT)
    network_memory(ftqp.qp.backend({"name": "dtrnn", "mode": mode}), session)
    assert session.K.cascade.accept == pytest.approx(accepted)
