"""A recorder changes no answer and keeps what was asked and answered."""

import numpy as np
import pytest
from recorded import SIZES, fill, record

import ftqp
from ftqp.core.errors import InputError
from ftqp.qp import Claim, QPBuffers, Recorder
from ftqp.qp.adapters.backend import Backend


class Puppet(Backend):
    """Answers with the claims it is given, and x = 1."""

    package = "none"

    def __init__(self, *claims):
        super().__init__("puppet")
        self.claims = list(claims)
        self.cold = []

    def _prepare(self, qp):
        """Nothing to prepare."""

    def _run(self, qp, cold):
        self.cold.append(cold)
        self.iterations = 10
        qp.solution[:] = 1.0
        claim = self.claims.pop(0)
        if isinstance(claim, BaseException):
            raise claim
        return claim


def test_answers_are_those_of_the_inner_backend():
    plain, buffers = ftqp.qp.backend("active_set"), QPBuffers.zeros(**SIZES)
    plain.setup(buffers)
    recorded = record(Recorder("active_set"), 6).recording(dt=0.1)
    for k in range(6):
        fill(buffers, k)
        assert plain.solve(cold=False) == recorded.claim[k]
        for name in ("x", "y", "z", "z_box"):
            np.testing.assert_array_equal(getattr(recorded, name)[k], getattr(buffers, name))


def test_recorded_problems_are_those_that_were_handed_over():
    buffers = QPBuffers.zeros(**SIZES)
    for k, problem in enumerate(record(Recorder("daqp"), 4).recording(dt=0.1)):
        fill(buffers, k)
        for name in ("H", "g", "A", "b", "C", "l", "u", "lb", "ub"):
            np.testing.assert_array_equal(getattr(problem, name), getattr(buffers, name))


@pytest.mark.parametrize("mode", ["slack", "scaled"])
@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_planner_moves_the_same_with_a_recorder(level, mode):
    robot = ftqp.robots.load("panda")
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=0.8)
    ends = []
    for backend in ("active_set", Recorder("active_set")):
        planner = ftqp.Planner(robot, 2e-3, level=level, task=ftqp.Task(mode=mode), backend=backend)
        planner.reset(robot.neutral)
        q, v = robot.neutral.copy(), np.zeros(robot.nv)
        for k in range(150):
            if k == 75:
                planner.report(ftqp.Locked(2))
            sample = path.sample(np.array([k * 2e-3]))
            target = ftqp.Target(
                pose=sample.pose[0], twist=sample.twist[0], acceleration=sample.acceleration[0]
            )
            step = planner.step(q, v, target)
            q, v = step.q.copy(), step.v.copy()
        ends.append(q)
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-9)


def test_ticks_and_names_are_those_of_the_planner():
    robot = ftqp.robots.load("planar6")
    recorder = Recorder("active_set", first=2, every=3)
    planner = ftqp.Planner(robot, 0.01, backend=recorder)
    recorder.follow(planner)
    planner.reset(robot.neutral)
    for _ in range(10):
        planner.step(robot.neutral, np.zeros(6), ftqp.Target(pose=robot.pose(robot.neutral)))
    recording = recorder.recording(dt=planner.dt)
    assert recording.tick.tolist() == [2, 5, 8]
    np.testing.assert_allclose(recording.time, [0.02, 0.05, 0.08])
    assert planner.backend == "recorder:active_set"
    assert recording.metadata["backend"] == "active_set"


def test_a_warm_start_that_fails_is_one_qp_with_its_last_answer():
    puppet = Puppet(Claim.SOLVED, Claim.MAX_ITERATIONS, Claim.SOLVED, Claim.SOLVED)
    recording = record(Recorder(puppet), 3).recording(dt=0.1)
    assert puppet.cold == [True, False, True, False]
    assert recording.tick.tolist() == [0, 1, 2]
    assert recording.claim.tolist() == [0, 0, 0]
    assert recording.cold.tolist() == [True, False, False]


def test_nothing_recorded_is_an_error_that_says_what_to_do():
    with pytest.raises(InputError, match="no QP was recorded; let the planner step"):
        Recorder("active_set").recording(dt=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"every": 0}, "every is 0, expected a whole number >= 1"),
        ({"limit": 0}, "limit is 0, expected a whole number >= 1"),
        ({"limit": True}, "limit is True"),
        ({"first": -1}, "first is -1"),
        ({"first": 3, "last": 2}, "last is 2, expected a whole number >= first, 3"),
        ({"inner": "daqpp"}, "did you mean 'daqp'"),
        ({"inner": Recorder("daqp")}, "recorder:daqp records already"),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        Recorder(**{"inner": "daqp", **arguments})
