"""The network in the loop: the active set's motion; a warm start in the record that dies with a fault."""

import numpy as np
import pytest

import ftqp
from ftqp.qp.problem import SolveStatus

DT = 1e-3


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


def test_a_lost_joint_on_a_circle_makes_the_motion_of_the_active_set(panda, home, level):
    path = ftqp.paths.Circle(home, 0.1, duration=2.0, axes=("x", "y"))
    fault = ftqp.Locked("panda_joint3")
    task = ftqp.Task(degrade=())  # only the active set can give up rows
    runs = [follow(ftqp.Planner(panda, DT, level=level, backend=name, task=task), path, 2000, fault, 1000)
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

    def test_a_lock_is_no_start_for_the_arm_before_it(self, panda, home):
        warm, cold = self.planner(panda, home), self.planner(panda, home)
        self.step(warm)
        for planner in (warm, cold):
            self.put_back(planner)
            planner.report(ftqp.Locked(2))
        a, b = (planner.step(self.q, self.v, self.target).a.copy() for planner in (warm, cold))
        np.testing.assert_array_equal(a, b)
