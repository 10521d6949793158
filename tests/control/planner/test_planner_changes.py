"""What a planner is told happens as a whole or not at all, whatever line an exception comes at."""

import itertools
import threading

import numpy as np
import pytest
from tests.going import closed_loop, started
from tests.interrupted import interrupted, stop

import ftqp

PANDA = ftqp.robots.load("panda")
DT = 1e-3
LOAD = ftqp.Payload(mass=0.5, com=[0.0, 0.0, 0.05])
TOOL = np.array([[1.0, 0, 0, 0.02], [0, 1, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]])
KINDS = {
    "clock": dict,
    "detector": lambda: {"detector": ftqp.Detector()},
    "timed": lambda: {"timing": True, "level": "velocity"},
}


class Ride:
    """A Panda that holds its place and does what it is told."""

    def __init__(self, kind="clock"):
        self.planner = ftqp.Planner(PANDA, DT, **KINDS[kind]())
        self.q = PANDA.neutral.copy()
        self.planner.reset(self.q)
        self.target = ftqp.Target(pose=PANDA.pose(self.q))

    def step(self):
        step = self.planner.step(self.q, None, self.target)
        self.q = step.q.copy()
        return step


@pytest.mark.parametrize("what", [float("nan"), 12.0, "x"])
def test_a_change_that_is_refused_changes_nothing(what):
    ride = Ride()
    before = ride.planner.session().memory.tobytes()
    for call in (
        lambda: ride.planner.report(ftqp.Locked("panda_joint9")),
        lambda: ride.planner.withdraw(17),
        lambda: ride.planner.carry(what),
        lambda: ride.planner.tool(what),
        lambda: ride.planner.reset([what] * 7 if what != 12.0 else [0.0]),
    ):
        with pytest.raises(ftqp.FtqpError):
            call()
        assert ride.planner.session().memory.tobytes() == before and ride.planner.faults == {}
    assert ride.step().status is ftqp.StepStatus.OK


CHANGES = {
    "lock": (lambda p: p.report(ftqp.Locked(3)), lambda p: PANDA.joints[3] in p.faults),
    "free": (lambda p: p.report(ftqp.FreeSwinging(5)), lambda p: PANDA.joints[5] in p.faults),
    "weak": (lambda p: p.report(ftqp.Degraded(1, velocity=0.01)), lambda p: PANDA.joints[1] in p.faults),
    "carry": (lambda p: p.carry(LOAD), lambda p: p.payload is not None),
    "tool": (lambda p: p.tool(TOOL), lambda p: p.robot.tip != PANDA.tip),
    "speed": (lambda p: setattr(p, "speed", 0.01), lambda p: p.speed == 0.01),
}


def commands(planner):
    """What a planner commands on the way to a place near by."""
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral + 0.1))
    steps = closed_loop(planner, target, 20, reset=False)
    return np.array([(step.q.copy(), step.tau.copy()) for step in steps])


@pytest.mark.long
@pytest.mark.parametrize("way", CHANGES)
@pytest.mark.parametrize("beside", [False, True], ids=["an exception", "another change"])
def test_a_change_that_is_interrupted_at_any_line_happened_or_did_not(way, beside):
    tell, told = CHANGES[way]
    expected = {}
    for line in itertools.count(0, 67 if way == "carry" else 7):
        planner, other = started(PANDA, DT), started(PANDA, DT)
        act = (lambda planner=planner: planner.report(ftqp.Locked(0))) if beside else stop
        met = interrupted(lambda planner=planner: tell(planner), line, act)
        made = told(planner), PANDA.joints[0] in planner.faults
        assert made == (True, met) if beside else made[0] or met
        if made not in expected:
            for happened, call in zip(made, (tell, lambda p: p.report(ftqp.Locked(0))), strict=True):
                if happened:
                    call(other)
            expected[made] = commands(other)
        assert np.array_equal(commands(planner), expected[made])
        if not met:
            break
    assert line > 12 and len(expected) == 2


class Slow:
    """A configuration that takes its time to be read, as a driver's may."""

    def __init__(self, q, inside, go_on):
        self._q, self._inside, self._go_on = q, inside, go_on

    def __array__(self, dtype=None, copy=None):
        self._inside.set()
        assert self._go_on.wait(20.0)
        return np.asarray(self._q)


@pytest.mark.parametrize("second", ["report", "withdraw", "reset", "carry", "tool", "step"])
def test_a_second_thread_inside_a_call_is_refused_with_a_sentence(second):
    ride, inside, go_on = Ride(), threading.Event(), threading.Event()
    calls = {
        "report": lambda: ride.planner.report(ftqp.Locked(3)),
        "withdraw": lambda: ride.planner.withdraw(3),
        "reset": lambda: ride.planner.reset(PANDA.neutral),
        "carry": lambda: ride.planner.carry(LOAD),
        "tool": lambda: ride.planner.tool(TOOL),
        "step": lambda: ride.planner.step(ride.q, None, ride.target),
    }
    first = threading.Thread(target=lambda: ride.planner.step(Slow(ride.q, inside, go_on), None, ride.target))
    first.start()
    assert inside.wait(20.0)
    try:
        with pytest.raises(
            ftqp.FtqpError, match=rf"planner\.{second} is called while another thread is inside planner\.step"
        ):
            calls[second]()
    finally:
        go_on.set()
        first.join()
    assert ride.planner.faults == {} and ride.step().status is ftqp.StepStatus.OK
    calls[second]()


@pytest.mark.parametrize("kind", ["task", "constraint", "configuration"])
def test_a_function_that_steps_the_planner_whose_step_asks_it_is_refused(kind):
    asked = {}

    def again(*_):
        if asked:
            asked["said"] = None
            try:
                asked["planner"].step(PANDA.neutral, None, target)
            except ftqp.InputError as error:
                asked["said"] = str(error)
                raise

    class Again:
        def __array__(self, dtype=None, copy=None):
            again()
            return np.asarray(PANDA.neutral)

    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    rows = {
        "task": {"tasks": [ftqp.Task(), ftqp.LeastSquares(1, again)]},
        "constraint": {"constraints": [ftqp.Rows(1, again)]},
        "configuration": {},
    }[kind]
    planner = ftqp.Planner(PANDA, **rows)
    planner.reset(PANDA.neutral)
    ticks = [planner.step(PANDA.neutral, None, target).code]
    asked["planner"] = planner
    if kind == "configuration":
        with pytest.raises(ftqp.InputError, match="q is not an array of numbers"):
            planner.step(Again(), None, target)
    else:
        step = planner.step(PANDA.neutral, None, target)
        said = step.tasks["LeastSquares"].failed if kind == "task" else planner.stopped_because
        assert "planner.step is called inside planner.step, by a function that it asks" in said
        assert planner.session().K.state.ticks == len(ticks) + 1, "one step is one tick"
    assert "fill in its arrays" in asked["said"]
    asked.clear()
    expected = ftqp.StepStatus.STOPPED if kind == "constraint" else ftqp.StepStatus.OK
    assert planner.step(PANDA.neutral, None, target).status is expected
