"""The gate: whatever the record holds, what leaves a tick is finite, in range and near what left last."""

import numpy as np
import pytest
from tests.going import closed_loop

import ftqp
from ftqp.kernel.feedback.gate import pass_gate
from ftqp.kernel.layout.enums import FREE
from ftqp.kernel.layout.record import ROOMS
from ftqp.kernel.layout.thresholds import LONGEST

PANDA = ftqp.robots.load("panda")
LIMITS = PANDA.limits
LEVELS = ("acceleration", "velocity")
DRIVES = ("position", "velocity", "torque")
DT = 1e-3
TRUSTED = {"gate", "chain", "limits"}
"""What the gate judges by, and the arm itself."""
SETTINGS = {
    "dt",
    "level",
    "kind",
    "latency",
    "span",
    "conversion",
    "external",
    "n",
    "nq",
    "m",
    "rows",
    "code",
    "order",
    "mode",
}
"""Whole numbers that sizes and branches follow from, and the period; Python writes them once."""
CIRCLE = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), radius=0.05, duration=3.0).sample(np.arange(3000) * DT)
WRONG = (np.nan, np.inf, -np.inf, 1e300, -1e4, 0.3)


class Ride:
    """A Panda on a circle that does what it is told."""

    def __init__(self, drive="position", level="acceleration", lead=False, ticks=30, **settings):
        kind = ftqp.Drive(bandwidth=80.0, takes_velocity=False) if lead else drive
        self.planner = ftqp.Planner(PANDA, DT, drive=kind, level=level, **settings)
        self.K = self.planner._session.K
        self.lead = float(self.K.monitor.stated_lead[0])
        q = PANDA.neutral
        self.targets = ftqp.Targets(CIRCLE.pose, CIRCLE.twist, CIRCLE.acceleration)
        self.planner.reset(q)
        self.q, self.at, self.failed = q.copy(), 0, np.zeros(7, bool)
        self.last = self.sent()
        for _ in range(ticks):
            assert self.tick().status is ftqp.StepStatus.OK

    def sent(self):
        feedback, n = self.K.feedback, 7
        if self.K.state.ticks == 0:
            return self.q.copy(), self.q.copy(), np.zeros(7)
        reference = self.step.reference
        return feedback.q_sent[:n].copy(), reference.q.copy(), reference.v.copy()

    def tick(self, sample=None):
        """One step, and a look at what leaves it."""
        self.step = self.planner.step(self.q if sample is None else sample, None, self.targets.at(self.at))
        self.at += 1
        sent, q, v = self.sent()
        for numbers in (sent, q, v, self.step.q, self.step.v, self.step.a, self.step.tau):
            assert np.isfinite(numbers).all()
        failed = self.K.faults.code[:7] != 0
        works, self.failed = ~(failed | self.failed), failed  # one that just returns begins where it was sent
        held = self.K.faults.code[:7] != FREE
        assert (sent >= LIMITS.q_min - 1e-9)[held].all() and (sent <= LIMITS.q_max + 1e-9)[held].all()
        top = LIMITS.v_max * (1 + 1e-8) + 1e-8
        lead = LONGEST * LIMITS.a_max * DT
        assert (abs(sent - self.last[0]) <= DT * top + lead)[held].all()
        assert (abs(q - self.last[1]) <= DT * top)[works].all() and (abs(v) <= top)[works].all()
        assert (abs(v - self.last[2]) <= DT * LIMITS.a_max * (1 + 1e-8) + 1e-8)[works].all()
        assert self.step.tau.dtype == float and (abs(self.step.tau) <= LIMITS.tau_max + 1e-6)[works].all()
        self.last = sent, q, v
        self.q = q if sample is None else self.q
        return self.step


@pytest.mark.parametrize("ticks", [0, 30])
@pytest.mark.parametrize("by", [1e-4, 3.0, np.nan])
def test_nothing_between_two_ticks_moves_the_reference(drive, level, ticks, by):
    ride, twin = Ride(drive, level, ticks=ticks), Ride(drive, level, ticks=ticks)
    for name in ("q_command", "v_command", "q", "v"):
        ride.K.state[name][:7] += by
    for _ in range(20):
        got, expected = ride.tick(), twin.tick()
        assert got.status is expected.status is ftqp.StepStatus.OK
        assert np.array_equal(got.q, expected.q) and np.array_equal(got.v, expected.v)


def fields():
    """Every field of the record that a tick may read and that is no size, by room."""
    for room, made in ROOMS.items():
        if room not in TRUSTED:
            for field in made(8):
                if field[0] not in SETTINGS:
                    yield room, field[0], field[1]


@pytest.mark.parametrize(
    ("drive", "level"),
    [
        pytest.param(
            drive, level, marks=[] if (drive, level) == ("torque", "velocity") else [pytest.mark.slow]
        )
        for drive in (*DRIVES, "lead")
        for level in LEVELS
    ],
)
@pytest.mark.parametrize("share", [7, pytest.param(1, marks=pytest.mark.slow)])
def test_whatever_the_record_holds_the_command_is_safe(drive, level, share):
    settings = {"lead": True} if drive == "lead" else {"drive": drive}
    places = [(room, name) for room, name, kind in fields() if kind == "f8"]
    assert len(places) > 150
    said = set()
    for room, name in places[::share]:
        ride = Ride(level=level, ticks=3, **settings)
        for wrong in WRONG:
            ride.K[room][name] = wrong
            for _ in range(3):
                said.add(ride.tick().status)
    assert {ftqp.StepStatus.OK, ftqp.StepStatus.FALLBACK} <= said


@pytest.mark.parametrize("bound", ["way", "speed", "acceleration", "room", "sent"])
@pytest.mark.parametrize("joint", [0, 5])
def test_the_gate_lets_through_what_just_keeps_a_bound_and_nothing_just_beyond(drive, level, bound, joint):
    ride = Ride(drive, level, ticks=1)
    K, q, top, a_max = ride.K, PANDA.neutral[joint], LIMITS.v_max[joint], LIMITS.a_max[joint]
    gate, state, feedback = K.gate, K.state, K.feedback
    for share in (0.999, 1.001):
        for room, sent, speed in (
            (gate, "sent", "v"),
            (state, "q_command", "v_command"),
            (feedback, "q_sent", "v_sent"),
        ):
            room[sent][:7], room[speed][:7] = PANDA.neutral, 0.0
        gate.q[:7], feedback.tau_sent[:7] = PANDA.neutral, 0.0
        if bound == "way":
            gate.v[joint] = state.v_command[joint] = 0.1
            state.q_command[joint] = q + share * DT * 0.1
        elif bound == "speed":
            gate.v[joint], state.v_command[joint] = top, share * top
        elif bound == "acceleration":
            state.v_command[joint] = share * DT * a_max
        elif bound == "room":
            gate.v[joint] = state.v_command[joint] = v = 0.3 * top
            way = (v / share) ** 2 / (2.0 * a_max) - (0.5 * DT * v if level == "velocity" else 0.0)
            gate.q[joint] = state.q_command[joint] = LIMITS.q_max[joint] - way
        elif drive == "position":
            feedback.q_sent[joint] = q + share * DT * (top + LONGEST * a_max)
        elif drive == "velocity":
            feedback.v_sent[joint] = share * top
        else:
            feedback.tau_sent[joint] = share * LIMITS.tau_max[joint]
        assert pass_gate(K) == (share < 1.0)


@pytest.mark.parametrize("joint", [0, 3])
def test_a_command_that_is_no_number_is_replaced_by_the_last_one_braked(drive, joint):
    ride = Ride(drive)
    v = ride.last[2].copy()
    if drive == "torque":
        ride.K.feedback.tau_slow[joint] = np.nan
    else:
        ride.K.monitor.stated_lead[:] = np.nan
    if drive == "velocity":
        ride.K.feedback.wound[joint] = np.nan
    step = ride.tick()
    assert step.status is ftqp.StepStatus.FALLBACK and ride.K.gate.shut == 1
    braked = np.sign(v) * np.maximum(abs(v) - LIMITS.a_max * DT, 0.0)
    assert step.reference.v == pytest.approx(braked, abs=1e-12)
    ride.K.monitor.stated_lead[:] = 0.0
    statuses = [ride.tick().status for _ in range(200)]
    assert statuses[-1] is ftqp.StepStatus.OK and ride.K.gate.shut == 1


@pytest.mark.parametrize("speed", [0.005, 0.3, 2.5])
@pytest.mark.parametrize("drive", ["position", "velocity"])
def test_a_locked_joint_whose_encoder_drifts_is_sent_where_it_is_locked(drive, speed):
    ride = Ride(drive)
    ride.planner.report(ftqp.Locked(3))
    for _ in range(60):
        ride.tick()
    place = ride.step.q[3]
    drift = 0.0
    for _ in range(1000):
        drift += speed * DT
        sample = ride.last[1].copy()
        sample[3] = place + drift
        step = ride.tick(sample)
        assert step.v[3] == 0.0 and step.a[3] == 0.0
    assert ride.K.faults.code[3] == 2
    assert step.q[3] == place
    assert LIMITS.q_min[3] <= step.q[3] <= LIMITS.q_max[3]


def test_a_locked_joint_that_stands_elsewhere_is_not_pulled_there():
    ride = Ride()
    ride.planner.report(ftqp.Locked(3))
    for _ in range(60):
        ride.tick()
    place = ride.step.q[3] - 0.002
    for _ in range(300):
        sample = ride.last[1].copy()
        sample[3] = place
        ride.tick(sample)
    assert ride.step.q[3] == place + 0.002
    assert ride.step.reference.q[3] == pytest.approx(place, abs=1e-6)


@pytest.mark.parametrize("lead", [False, True])
@pytest.mark.parametrize("off", [0.0, 0.3])
def test_what_is_sent_goes_on_from_where_it_was_when_a_joint_works_again(lead, off):
    """The sensor of the locked joint drifted by ``off``, which nobody followed; its servo stands."""
    ride = Ride(lead=lead)
    ride.planner.report(ftqp.Locked(3))
    for _ in range(60):
        ride.tick()
    for k in range(300):
        sample = ride.last[1].copy()
        sample[3] = ride.step.q[3] + off * k / 300
        ride.tick(sample)
    ride.planner.withdraw(3)
    for _ in range(50):
        ride.tick(ride.last[1].copy())
    assert ride.K.gate.shut == 0


@pytest.mark.parametrize("fault", [
    ftqp.Locked(3), ftqp.Locked(3, mode="instant"), ftqp.Locked(1, mode="instant", reset="task"),
    ftqp.Locked(1, mode="instant", reset="momentum"), ftqp.FreeSwinging(5, damping=1.0),
    ftqp.Degraded(2, velocity=0.1, acceleration=0.3, torque=0.9),
])  # fmt: skip
def test_no_fault_that_is_told_shuts_the_gate(fault, level):
    ride = Ride(level=level)
    ride.planner.report(fault)
    for k in range(400):
        ride.step = ride.planner.step(ride.q, None, ride.targets.at(ride.at))
        ride.q, ride.at = ride.step.q.copy(), ride.at + 1
        if k == 200:
            ride.planner.withdraw(fault.joint)
    assert ride.K.gate.shut == 0


@pytest.mark.parametrize("bounds", ["jin", "one_step", "viability"])
def test_bounds_as_published_pass_the_gate(bounds):
    planner = ftqp.Planner(PANDA, 1e-3, bounds=bounds)
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    target.position[0] += 0.4
    *_, _ = closed_loop(planner, target, 500)
    assert planner.session().K.gate.shut == 0


@pytest.mark.parametrize("bounds", ["jin", "one_step"])
def test_a_joint_that_cannot_stop_in_time_is_not_sent_beyond_its_range(bounds, drive):
    """Bounds that keep no room to brake let a joint come too fast to its end: it ends there at once."""
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, dt=0.01, bounds=bounds, drive=drive)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    q[3], v[3] = robot.limits.q_min[3] + 0.03, -2.0
    planner.reset(q, v)
    planner.stop()
    target = ftqp.Target(pose=robot.pose(q))
    for _ in range(120):
        step = planner.step(q, v, target)
        assert (step.q >= robot.limits.q_min).all()
        q, v = step.reference.q.copy(), step.reference.v.copy()
    assert step.status is ftqp.StepStatus.STOPPED
