"""A wrong first argument of a public constructor gets a sentence that says what to give."""

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
CIRCLE = ftqp.paths.Circle(np.eye(4), 0.1, duration=1.0)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda x: ftqp.Planner(x), "robot is {}, expected an ftqp.Robot, for example ftqp.robots.load"),
        (lambda x: ftqp.Planner(PANDA, task=x), "task is {}, expected an ftqp.Task or None"),
        (lambda x: ftqp.Planner(PANDA, emergency=x), "emergency is {}, expected an ftqp.EmergencyStop"),
        (lambda x: ftqp.Planner(PANDA, branch_limits=x), "branch_limits is {}, expected joints with their"),
        (lambda x: ftqp.PathFollower(x, CIRCLE), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.InertialTask(x), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.GoTo(x, q=np.zeros(7)), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.TargetFollower(x), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.Simulation(ftqp.Planner(PANDA), x, q=np.zeros(7)), "path is {}, expected a path of"),
        (lambda x: ftqp.KinematicPlant(x, 1e-3), "robot is {}, expected an ftqp.Robot"),
        (lambda x: ftqp.Schedule([x]), "an event is {}, expected an ftqp.FaultEvent"),
        (
            lambda x: ftqp.Robot.from_pinocchio(x),
            "model is {}, expected a pinocchio.Model; files",
        ),
    ],
)
@pytest.mark.parametrize("given", ["panda", 7])
def test_something_else_is_refused_with_what_is_expected(call, sentence, given):
    with pytest.raises(ftqp.InputError, match=sentence.format(repr(given)).replace("(", r"\(")):
        call(given)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: ftqp.PathFollower(ftqp.Planner(PANDA), 1), "path is 1, expected a path of ftqp.paths"),
        (lambda: ftqp.Schedule(3), "events is 3, expected a list of ftqp.FaultEvent"),
        (lambda: ftqp.Task(rows=3), "rows is 3, expected pose, position, position_axis or names of rows"),
        (lambda: ftqp.load_scenario(3), "source is 3, expected the path of a scenario or the name"),
        (lambda: ftqp.load_log(None), "path is None, expected the path of a log or of the folder of a run"),
    ],
)  # fmt: skip
def test_the_second_and_others_too(call, sentence):
    with pytest.raises(ftqp.FtqpError, match=sentence):
        call()
