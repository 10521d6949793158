"""Calls in any order, with good and bad inputs, mistakes and interruptions: every step keeps its promises.

A second planner hears what is no mistake and is never interrupted. Both must command the same, bit by bit:
what is refused changes nothing, and an interrupted call is made as a whole or not at all. A longer search::

    pytest tests/robustness/test_calls_in_any_order.py -m slow
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

import ftqp

SOURCE = str(Path(ftqp.__file__).parent)
ARMS = {name: ftqp.robots.load(name) for name in ("panda", "planar(4)", "srs7")}
BAD_NUMBERS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324)
NO_ARRAYS = (None, "home", object(), [], [[1.0]], 1 + 1j, np.zeros(99))
NO_JOINTS = ("elbow", "", -1, 99, 1.5, None, True, (0,), 2**70)
FORMS = {
    "list": list,
    "tuple": tuple,
    "strided": lambda q: np.repeat(q, 2)[::2],
    "backwards": lambda q: q[::-1].copy()[::-1],
    "objects": lambda q: q.astype(object),
    "other bytes": lambda q: q.astype(">f8"),
    "longer": lambda q: q.astype(np.longdouble),
    "read only, at an odd address": lambda q: np.frombuffer(b"0" + q.tobytes(), offset=1),
    "column": lambda q: np.asfortranarray(np.tile(q, (3, 1)))[1],
}
ROUNDING = 1e-9
SMALL = st.floats(-0.05, 0.05)
SHARES = st.floats(0.6, 1.0)
JOINTS = st.integers(0, 99)


class Interruption(BaseException):
    """What a signal handler raises."""


def interrupt(call, line):
    """Make a call that is interrupted when so many lines of ftqp have run, 0 is never: whether it was."""
    left = line

    def at_line(frame, event, arg):
        nonlocal left
        left -= event == "line"
        if left == 0:
            raise Interruption
        return at_line

    before = sys.gettrace()
    sys.settrace(lambda frame, *_: at_line if frame.f_code.co_filename.startswith(SOURCE) else None)
    try:
        call()
    except Interruption:
        return True
    finally:
        sys.settrace(before)
    return False


class Calls(RuleBasedStateMachine):
    """A planner, its undisturbed twin, and an arm that does what the planner's reference says."""

    @initialize(
        name=st.sampled_from(sorted(ARMS)),
        level=st.sampled_from(["acceleration", "velocity"]),
        mode=st.sampled_from(["slack", "hard", "scaled", "lexicographic"]),
        drive=st.sampled_from(["position", "velocity"]),
        dt=st.sampled_from([0.001, 0.005]),
    )
    def begin(self, name, level, mode, drive, dt):
        self.robot = ARMS[name]
        self.make = lambda: ftqp.Planner(self.robot, dt, level=level, task=ftqp.Task(mode=mode), drive=drive)
        self.planner, self.twin = self.make(), self.make()
        self.faults, self.asked_to_stop = {}, False
        self.base = self.robot.pose(self.robot.neutral)
        self.target = ftqp.Target(pose=self.base)
        self.tell(lambda planner: planner.reset(self.robot.neutral))
        self.start(self.robot.neutral)

    def start(self, q):
        """The arm rests here."""
        self.q, self.v = q.copy(), np.zeros(self.robot.nv)
        self.new = set(range(self.robot.nv))

    def tell(self, call):
        """Tell both planners."""
        call(self.planner)
        call(self.twin)

    @rule(joint=JOINTS, deceleration=st.sampled_from([None, 0.01, 1e5]), line=st.integers(0, 400))
    def lock(self, joint, deceleration, line):
        given = {} if deceleration is None else {"deceleration": deceleration}
        self.report(ftqp.Locked(joint % self.robot.nv, **given), line)

    @rule(joint=JOINTS, line=st.integers(0, 400))
    def swing(self, joint, line):
        if self.robot.has_inertia:
            self.report(ftqp.FreeSwinging(joint % self.robot.nv), line)

    @rule(joint=JOINTS, velocity=SHARES, torque=SHARES, line=st.integers(0, 400))
    def weaken(self, joint, velocity, torque, line):
        self.report(ftqp.Degraded(joint % self.robot.nv, velocity=velocity, torque=torque), line)

    def report(self, fault, line):
        if len(self.faults) < 3 or fault.joint in self.faults:
            self.hear(lambda planner: planner.report(fault), {**self.faults, fault.joint: fault}, line)

    @precondition(lambda self: self.faults)
    @rule(joint=JOINTS, line=st.integers(0, 400))
    def withdraw(self, joint, line):
        joint = list(self.faults)[joint % len(self.faults)]
        left = {other: fault for other, fault in self.faults.items() if other != joint}
        self.hear(lambda planner: planner.withdraw(joint), left, line)

    @rule(mass=st.none() | st.floats(0.01, 1.0), line=st.integers(0, 400))
    def carry(self, mass, line):
        if self.robot.has_inertia:
            load = None if mass is None else ftqp.Payload(mass)
            self.hear(lambda planner: planner.carry(load), self.faults, line)

    def hear(self, call, faults, line):
        """Tell the planner something, interrupted at a line of it; 0 is not at all."""
        before, after = self.names(self.faults), self.names(faults)
        made = not interrupt(lambda: call(self.planner), line)
        assert self.planner.faults == after if made else self.planner.faults in (before, after)
        if not made and self.planner.faults == before:  # made again, as a user would
            call(self.planner)
        call(self.twin)
        self.new |= {j for j in {*faults, *self.faults} if faults.get(j) is not self.faults.get(j)}
        self.faults = dict(faults)

    def names(self, faults):
        return {self.robot.joints[joint]: fault for joint, fault in faults.items()}

    @rule(shift=SMALL)
    def reset(self, shift):
        q = np.clip(self.robot.neutral + shift, self.robot.limits.q_min, self.robot.limits.q_max)
        self.tell(lambda planner: planner.reset(q))
        self.asked_to_stop = False
        self.start(q)

    @rule()
    def stop(self):
        self.tell(lambda planner: planner.stop())
        self.asked_to_stop = True

    @rule()
    def resume(self):
        resumed = self.planner.resume()
        assert self.twin.resume() == resumed
        self.asked_to_stop = self.asked_to_stop and not resumed

    @rule(share=st.floats(0.1, 1.0))
    def slow_down(self, share):
        self.tell(lambda planner: setattr(planner, "speed", share))

    @rule(x=SMALL, y=SMALL, z=SMALL)
    def move_target(self, x, y, z):
        T = self.base.copy()
        T[:3, 3] += x, y, z if "z" in self.robot.default_rows else 0.0
        self.target.at(T)

    def refused(self, call):
        """A mistake gets one sentence, and changes nothing, as the twin shows."""
        with pytest.raises(ftqp.FtqpError) as error:
            call()
        assert "\n" not in str(error.value) and 10 < len(str(error.value)) < 600
        for name in ("speed", "faults", "payload", "stopped_because"):
            assert getattr(self.planner, name) == getattr(self.twin, name), name

    @rule(joint=st.sampled_from(NO_JOINTS), call=st.sampled_from(["report", "withdraw"]))
    def name_no_joint(self, joint, call):
        given = (lambda: ftqp.Locked(joint)) if call == "report" else (lambda: joint)
        self.refused(lambda: getattr(self.planner, call)(given()))

    @rule(share=st.sampled_from([np.nan, np.inf, -1.0, 0.0, 1.1, "fast", None, [0.5]]))
    def ask_for_no_speed(self, share):
        self.refused(lambda: setattr(self.planner, "speed", share))

    @rule(wrong=st.sampled_from(NO_ARRAYS), name=st.sampled_from(["q", "v", "tau", "tip", "target", "reset"]))
    def hand_in_no_array(self, wrong, name):
        if name == "reset":
            self.refused(lambda: self.planner.reset(wrong))
        elif wrong is not None or name in ("q", "target"):  # the others may be left out
            given = {"q": self.q, "v": None, "target": self.target} | {name: wrong}
            self.refused(lambda: self.planner.step(**given))

    @rule(fault=st.sampled_from([None, "locked", 3, {"joint": 0}, ftqp.Locked, object()]))
    def report_no_fault(self, fault):
        self.refused(lambda: self.planner.report(fault))

    @rule(
        load=st.sampled_from([3.0, "box", ftqp.Payload]),
        T=st.sampled_from([np.eye(3), "hand", np.zeros((4, 4))]),
    )
    def take_no_load_and_no_tool(self, load, T):
        self.refused(lambda: self.planner.carry(load))
        self.refused(lambda: self.planner.tool(T))

    @rule(count=st.integers(1, 30))
    def step(self, count):
        for _ in range(count):
            self.judge(*[planner.step(self.q, None, self.target) for planner in (self.planner, self.twin)])

    @rule(number=st.sampled_from(BAD_NUMBERS), joint=JOINTS, name=st.sampled_from(["q", "v", "tip", "tau"]))
    def step_with_bad_numbers(self, number, joint, name):
        if name == "tau" and not self.robot.has_inertia:
            return
        good = {"q": self.q, "v": self.v, "tip": self.robot.pose(self.q), "tau": np.zeros(self.robot.nv)}
        bad = good[name].copy()
        bad.flat[joint % bad.size] = number
        given = {"q": self.q, "target": self.target, name: bad}
        finite = bool(np.isfinite(bad).all())
        self.judge(*[planner.step(**given) for planner in (self.planner, self.twin)], finite=finite)

    @rule(form=st.sampled_from(sorted(FORMS)))
    def step_with_other_forms(self, form):
        """The same numbers in another form are the same, and what was handed in may be overwritten."""
        q = FORMS[form](self.q)
        step, other = self.planner.step(q, None, self.target), self.twin.step(self.q, None, self.target)
        if getattr(getattr(q, "flags", None), "writeable", False):
            q[:] = np.nan
        self.judge(step, other)

    @rule()
    def write_into_what_is_handed_out(self):
        """It is a copy, or cannot be written."""
        step, other = [planner.step(self.q, None, self.target) for planner in (self.planner, self.twin)]
        for array in (step.q, step.v, step.a, step.reference.q, step.reference.v):
            kept = array.copy()
            try:
                array[:] = np.nan
            except ValueError:
                continue
            array[:] = kept
        self.judge(step, other)

    @rule(line=st.integers(1, 60))
    def interrupt_a_step(self, line):
        """What a step had begun is not known outside: the planner begins anew, as its twin does."""
        interrupt(lambda: self.planner.step(self.q, None, self.target), line)
        step = self.planner.step(self.q, None, self.target)
        assert np.isfinite(step.q).all() and np.isfinite(step.v).all()
        self.planner, self.twin = self.make(), self.make()
        self.faults, self.asked_to_stop = {}, False
        self.tell(lambda planner: planner.reset(self.q))
        self.start(self.q)

    def judge(self, step, other, finite=True):
        """Every promise of a step."""
        assert step.status is other.status
        for name in ("q", "v", "a"):
            assert getattr(step, name).tobytes() == getattr(other, name).tobytes(), name
        limits, status, dt = self.robot.limits, step.status.name, self.planner.dt
        q, v = step.reference.q.copy(), step.reference.v.copy()
        assert all(np.isfinite(x).all() for x in (step.q, step.v, step.a, q, v))
        assert finite or status != "OK"
        assert not self.asked_to_stop or status in ("STOPPING", "STOPPED", "INVALID_INPUT")
        failed = {j for j, fault in self.faults.items() if not fault.works}
        for i in {*range(self.robot.nv)} - failed - self.new:
            assert limits.q_min[i] - ROUNDING <= q[i] <= limits.q_max[i] + ROUNDING, (i, status)
            assert abs(v[i]) <= limits.v_max[i] * (1.0 + ROUNDING), (i, status)
            assert abs(v[i] - self.v[i]) <= limits.a_max[i] * dt * (1.0 + ROUNDING) + ROUNDING, (i, status)
        for i, fault in self.faults.items():
            if isinstance(fault, ftqp.Locked) and i not in self.new:
                assert abs(v[i]) <= abs(self.v[i]) * (1.0 + ROUNDING), (i, status)
        free = [i for i, fault in self.faults.items() if isinstance(fault, ftqp.FreeSwinging)]
        v[free] = 0.0  # the air is thick here: what swings stands
        q[free] = self.q[free]
        self.q, self.v = q, v
        self.new = set()


FEW = settings(
    max_examples=20, stateful_step_count=40, deadline=None, derandomize=True, phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)  # fmt: skip


class TestCalls(Calls.TestCase):
    settings = FEW


@pytest.mark.slow
class TestManyCalls(Calls.TestCase):
    settings = settings(FEW, max_examples=2000, stateful_step_count=80, derandomize=False)
