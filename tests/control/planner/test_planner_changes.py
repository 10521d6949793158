"""What a planner is told happens as a whole or not at all, whatever line an exception comes at."""

import itertools
import threading

import numpy as np
import pytest
from tests.interrupted import interrupted

import ftqp
from ftqp.control.planner.planner_view import JointState
from ftqp.faults.belief import Belief
from ftqp.kernel.layout.enums import BRAKING, FREE, HEALTHY, INSTANT, LOCKED

PANDA = ftqp.robots.load("panda")
DT = 1e-3
LOAD = ftqp.Payload(mass=0.5, com=[0.0, 0.0, 0.05])
TOOL = np.array([[1.0, 0, 0, 0.02], [0, 1, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]])
HELD = {BRAKING, LOCKED, INSTANT}
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


def agreement(planner, session=None):
    """What is said of a planner's belief and what its kernel goes by, where they differ."""
    session = session or planner.session()
    K, faults = session.K, planner.faults
    healthy = Belief(PANDA)
    for fault in faults.values():
        healthy = healthy.reported(fault)
    copy = session.copy()
    healthy.write(planner._parts.commands.on(copy))
    expected = copy.K
    found = []
    for i, name in enumerate(PANDA.joints):
        code, fault = int(K.faults.code[i]), faults.get(name)
        held, free = isinstance(fault, ftqp.Locked), isinstance(fault, ftqp.FreeSwinging)
        if (code in HELD) != held or (code == FREE) != free or (code == HEALTHY) != (not held and not free):
            found.append(f"{name}: {fault} and code {code}")
        for limit in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
            if getattr(K.limits, limit)[i] != getattr(expected.limits, limit)[i]:
                found.append(f"{name}: {limit}")
    if K.feedback.speed != planner.speed:
        found.append("speed")
    if bool(K.limits.dynamic) != (planner._given.dynamic or healthy.needs_dynamics):
        found.append("dynamic")
    return found


CHANGES = {
    "lock": (lambda p: p.report(ftqp.Locked(3)), lambda p: p.withdraw(3), lambda p: len(p.faults) == 1),
    "free": (lambda p: p.report(ftqp.FreeSwinging(5)), lambda p: p.withdraw(5), lambda p: len(p.faults) == 1),
    "weak": (
        lambda p: p.report(ftqp.Degraded(1, velocity=0.5, q_min=-1.0)),
        lambda p: p.withdraw(1),
        lambda p: len(p.faults) == 1,
    ),
    "reset": (lambda p: p.reset(PANDA.neutral + 0.1), lambda p: p.reset(PANDA.neutral), None),
    "carry": (lambda p: p.carry(LOAD), lambda p: p.carry(None), lambda p: p.payload is not None),
    "tool": (lambda p: p.tool(TOOL), lambda p: p.tool(None), lambda p: p.robot.tip != PANDA.tip),
    "speed": (
        lambda p: setattr(p, "speed", 0.25),
        lambda p: setattr(p, "speed", 1.0),
        lambda p: p.speed == 0.25,
    ),
}


def settled(planner, ride, happened, way):
    """After an interruption: it happened or it did not, for the planner and for its kernel."""
    said = happened(planner) if happened is not None else None
    assert agreement(planner) == [], "without another call"
    if way == "reset":
        ride.q = planner.session().K.gate.q[:7].copy()
    ride.step()
    session = planner.session()
    assert agreement(planner, session) == []
    assert said is None or happened(planner) == said
    mass = session.K.chain.mass[:7].sum()
    assert (mass > PANDA_MASS + 0.4) == (planner.payload is not None)
    assert np.allclose(planner.robot.pose(PANDA.neutral)[:3, 3], tip_of(planner), atol=1e-12)


def tip_of(planner):
    at_rest = JointState(PANDA.neutral, np.zeros(7), np.zeros(7))
    return planner.view().tip_at(at_rest).pose[:3, 3]


PANDA_MASS = ftqp.Planner(PANDA, DT).session().K.chain.mass[:7].sum()


@pytest.mark.long
@pytest.mark.parametrize("share", [7, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("kind", "way"),
    [("clock", way) for way in CHANGES if way not in ("carry", "tool")]
    + [("detector", "lock"), ("detector", "carry"), ("timed", "lock")]
    + [pytest.param("detector", way, marks=pytest.mark.slow) for way in ("reset", "tool", "weak")],
)
def test_a_change_that_is_interrupted_at_any_line_happened_or_did_not(kind, way, share):
    there, back, happened = CHANGES[way]
    ride = Ride(kind)
    planner = ride.planner
    # what looks at the motors takes milliseconds, and a detector begins anew at every reset; what every kind
    # of planner does is looked at line by line when a joint locks
    stride = 13 if way == "carry" else 7 if kind == "detector" and way in ("reset", "tool") else 3
    stride = share * (1 if (kind, way) == ("clock", "lock") else stride)
    for call, lines in ((there, itertools.count(0, stride)), (back, itertools.count(stride // 2, stride))):
        cut = 0
        for line in lines:
            was_cut = interrupted(lambda call=call: call(planner), line)
            settled(planner, ride, happened, way)
            if not was_cut:
                break
            cut += 1
            (back if call is there else there)(planner)  # begins anew, so that every line is met
            ride.q = PANDA.neutral.copy()
            if way != "reset":
                planner.reset(ride.q)
        assert cut > 12 // share
        if happened is not None:
            assert happened(planner) == (call is there)


@pytest.mark.long
@pytest.mark.parametrize(
    "way", ["lock", *(pytest.param(way, marks=pytest.mark.slow) for way in ("free", "weak"))]
)
@pytest.mark.parametrize("share", [7, pytest.param(1, marks=pytest.mark.slow)])
def test_a_change_inside_another_one_at_any_line_leaves_belief_and_kernel_at_one(way, share):
    there, back, _ = CHANGES[way]
    ride = Ride()
    planner = ride.planner
    for line in itertools.count(0, share):
        met = interrupted(lambda: there(planner), line, lambda: planner.report(ftqp.Locked(0)))
        assert (PANDA.joints[0] in planner.faults) == met
        settled(planner, ride, None, way)
        back(planner)
        planner.withdraw(0)
        ride.q = PANDA.neutral.copy()
        planner.reset(ride.q)
        if not met:
            break
    assert line > 20


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
