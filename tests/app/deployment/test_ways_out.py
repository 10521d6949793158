"""Ways out are tried in C as in Python and gone bit by bit, by an arm that has failed and stands."""

import ctypes

import numpy as np
import pytest
from tests.app.deployment import in_c
from tests.app.deployment.in_c import PANDA, Library, fault_of, numbers
from tests.app.deployment.test_going import Both
from tests.control.following.test_ways import LEFT, RIGHT, walled
from tests.control.planner.test_free_base import BODY
from tests.control.planner.ways.test_ways_out import LAGS

import ftqp
from ftqp.app.deployment.headers import arm_file
from ftqp.kernel.layout.ways_room import WayKind

pytestmark = pytest.mark.long
HOME = PANDA.neutral
AWAY = HOME + np.array([0.5, -0.3, 0.4, 0.3, -0.5, 0.6, 0.3])
KINDS = ("back", "back by the tip", "home", "halt", "stop")
STILL = {6: "pose", 5: "position_axis", 3: "position", 0: ""}
FIGURES = ("time", "clearance", "effort", "limit", "force", "moment")


class Way(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_int64) for name in ("kind", "clear", "arrives", "near", "still", "rows")),
        *((name, ctypes.c_double) for name in FIGURES),
    )


class Ways:
    """Ways out in C, and the memory that they have."""

    def __init__(self, arm):
        self.arm = arm
        arm.code.ftqp_ways_size.restype = ctypes.c_size_t
        self.room = np.full(arm.call("ways_size") + 64, 255, np.uint8)
        self.at = ctypes.c_void_p(self.room.ctypes.data + -self.room.ctypes.data % 64)

    def ask(self, home=None):
        return self.arm.call("ways_out", self.at, None if home is None else numbers(home))

    def next(self, looks, way):
        return self.arm.code.ftqp_try(self.at, looks, ctypes.byref(way))

    def tried(self, looks):
        """All of them, in the order in which they are tried."""
        found, way, calls = [], Way(), 0
        while (code := self.next(looks, way)) != -46:
            calls += 1
            assert code in (0, 1)
            if code:
                found.append(Way.from_buffer_copy(way))
        return found, calls


def same_ways(both, home, looks=500):
    """Both are asked, and answer the same: Python's ways, by kind, and those of C."""
    ways = Ways(both.arm)
    assert ways.ask(home) == 0
    found, calls = ways.tried(looks)
    given = sorted(both.planner.ways_out(home=home), key=lambda way: KINDS.index(way.kind))
    assert [way.kind for way in given] == [KINDS[way.kind] for way in found]
    for one, other in zip(given, found, strict=True):
        assert (one.clear, one.arrives, one.near) == (other.clear, other.arrives, other.near), one
        assert one.still == STILL[other.still] and bool(one.rows) == bool(other.rows)
        for figure in FIGURES:
            assert getattr(one, figure) == getattr(other, figure), (one.kind, figure)
    return {way.kind: way for way in given}, ways, calls


def fail_and_stop(both, fault, at=250, ticks=400):
    """An arm on its way loses a joint, and is stopped by its operator."""
    both.go(at)
    both.report(fault)
    both.go(ticks - at)
    both.planner.stop()
    assert both.arm.call("stop") == 0
    both.go(600)
    assert both.goto.status is ftqp.GoToStatus.HALTED


def go_out(both, ways, way):
    both.goto = ftqp.GoTo(both.planner, way=way)
    assert both.arm.call("go_out", ways.at, KINDS.index(way.kind)) == 0
    if both.planner.stopped_because:
        assert both.planner.resume() and both.arm.call("resume") == 1
    began = both.steps
    both.go(20_000)
    return both.steps - began


@pytest.mark.parametrize("kind", KINDS)
def test_an_arm_that_has_lost_a_joint_and_was_stopped_goes_each_way_out_as_in_python(built, level, kind):
    both = Both(built, AWAY, remember=20.0, level=level)
    fail_and_stop(both, ftqp.Locked(3))
    given, ways, _ = same_ways(both, HOME)
    assert set(given) >= {"back", "home", "halt", "stop"}
    if kind in given:
        assert given[kind].clear
        steps = go_out(both, ways, given[kind])
        assert both.goto.status is ftqp.GoToStatus.REACHED
        assert steps == round(given[kind].time / both.planner.dt)  # as announced, to the tick
        assert np.abs(both.q - given[kind].places[-1]).max() < 1e-3


def test_an_arm_that_moves_is_asked_a_little_in_every_tick_and_looks_of_any_number_find_the_same(built):
    both = Both(built, AWAY, remember=20.0)
    both.go(200)
    both.report(ftqp.Locked(1))
    calls = [same_ways(both, HOME, looks)[2] for looks in (1, 50, 100_000)]
    assert calls[0] > 20 * calls[1] > 400 > calls[2]


@pytest.mark.parametrize(("drive", "lag"), [(LAGS, 0.95), ("torque", 0.0)])
def test_arms_that_lag_or_take_torques_have_the_ways_out_of_python(built, drive, lag):
    both = Both(built, AWAY, lag, remember=20.0, drive=drive)
    both.go(200)
    both.report(ftqp.Locked(3))
    both.go(100)
    assert all(way.clear for way in same_ways(both, HOME)[0].values())


@pytest.mark.parametrize("name", ["iiwa14", "modular11", "planar"])
@pytest.mark.parametrize("seed", range(3))
def test_arms_of_all_kinds_have_the_ways_out_of_python_whatever_has_failed(built, name, seed):
    rng, robot = (
        np.random.default_rng(seed),
        ftqp.robots.load(name, **({"count": 5} if name == "planar" else {})),
    )
    low = np.maximum(robot.limits.q_min, robot.neutral - 1.5)
    high = np.minimum(robot.limits.q_max, robot.neutral + 1.5)
    both = Both(built, rng.uniform(low, high), 0.0, robot, remember=5.0)
    both.go(int(rng.integers(50, 500)))
    fault = (ftqp.Locked(1), ftqp.Degraded(2, velocity=0.5), ftqp.Locked(0))[seed]
    both.report(fault)
    both.go(20)
    given, ways, _ = same_ways(both, rng.uniform(low, high))
    way = max(given.values(), key=lambda way: (way.clear, way.time))
    go_out(both, ways, way)
    assert both.goto.status is (ftqp.GoToStatus.REACHED if way.arrives else both.goto.status)


def test_a_way_home_leads_round_a_wall_as_in_python(built):
    planner, _ = walled(clearance=ftqp.Clearance(keep=0.02, stop=0.0))
    both = Both.__new__(Both)
    in_c.Both.__init__(both, built, planner, LEFT)
    both.report(ftqp.Locked(6))
    given, ways, _ = same_ways(both, RIGHT)
    home = given["home"]
    assert home.clear and len(home.places) > 1 and 0.0 < home.clearance < 0.1
    go_out(both, ways, home)
    assert both.goto.status is ftqp.GoToStatus.REACHED and np.abs(both.q - home.places[-1]).max() < 1e-3


def test_a_joint_that_hangs_at_rest_is_braked_first_and_one_that_swings_leaves_a_stop(built):
    both = Both(built, AWAY)
    both.planner.report(ftqp.FreeSwinging(5))
    assert both.arm.call("report", fault_of(5, in_c.KINDS["free_swinging"])) == 0
    given, ways, _ = same_ways(both, AWAY)
    assert given["home"].brakes == ("panda_joint6",)
    go_out(both, ways, given["home"])
    assert both.goto.status is ftqp.GoToStatus.REACHED
    assert both.arm.call("believed", 5) == in_c.KINDS["locked"]
    moving = Both(built, AWAY)
    moving.go(200)
    moving.planner.report(ftqp.FreeSwinging(5))
    assert moving.arm.call("report", fault_of(5, in_c.KINDS["free_swinging"])) == 0
    assert list(same_ways(moving, HOME)[0]) == ["stop"]


def test_all_joints_locked_leave_a_stop_on_which_nothing_moves(built):
    both = Both(built, AWAY, remember=20.0)
    both.go(200)
    for joint in range(7):
        both.report(ftqp.Locked(joint))
    for _ in range(1500):
        both.step()
    given, ways, _ = same_ways(both, HOME)
    assert list(given) == ["stop"] and given["stop"].clear
    q = both.q.copy()
    go_out(both, ways, given["stop"])
    np.testing.assert_array_equal(both.q, q)


def test_what_has_no_ways_out_is_answered_by_a_number(built):
    arm = Library(built, arm_file(ftqp.Planner(PANDA).deployable(), 7))
    arm.code.ftqp_ways_size.restype = ctypes.c_size_t
    assert arm.call("ways_size") == 0 and arm.open() == 0
    ways, way = Ways(arm), Way()
    assert arm.call("has", 8) == 1 and arm.call("has", 9) == 0  # no way back, as nothing is remembered
    assert ways.next(10, way) == arm.call("go_out", ways.at, 2) == -45 and ways.ask() == -3
    assert arm.reset(HOME) == 0
    assert arm.call("ways_out", None, None) == ways.ask(np.full(7, np.nan)) + 24 == -20
    assert arm.call("ways_out", ctypes.c_void_p(ways.at.value + 8), None) == -21
    assert ways.next(10, way) == -45 and ways.ask() == 0
    assert ways.next(0, way) == -32 and arm.code.ftqp_try(ways.at, 10, None) == -20
    assert arm.call("go_out", ways.at, 3) == -46 and arm.call("go_out", ways.at, 7) == -46
    assert [KINDS[one.kind] for one in ways.tried(1000)[0]] == ["halt", "stop"]  # no home was said
    assert arm.call("go_out", ways.at, WayKind.HOME) == -46 and arm.call("go_out", None, 3) == -20
    assert arm.call("go_out", ways.at, WayKind.HALT) == 0 and ways.next(10, way) == -46
    assert arm.call("go", numbers(HOME), None) == 0 and arm.call("arrived") == 1  # it stands well there
    floats = PANDA.on_free_base(BODY)
    afloat = Library(built, arm_file(ftqp.Planner(floats).deployable(), floats.nv))
    assert afloat.open() == afloat.reset(floats.neutral) == 0 and afloat.call("has", 8) == 0
    assert Ways(afloat).ask() == -34
