"""A posture is gone to in C as by ``ftqp.GoTo`` in Python, bit by bit, whatever fails on the way."""

import ctypes

import numpy as np
import pytest
from tests.app.deployment import in_c
from tests.app.deployment.in_c import PANDA, Library, fault_of, numbers
from tests.control.following.test_ways import LEFT, RIGHT, moved, walled

import ftqp
from ftqp.app.deployment.headers import arm_file
from ftqp.control.planner.ways.ways import Ways

pytestmark = pytest.mark.long
HOME = PANDA.neutral
AWAY = HOME + np.array([0.5, -0.3, 0.4, 0.3, -0.5, 0.6, 0.3])
STATUSES = list(ftqp.GoToStatus)
LOCKED = in_c.KINDS["locked"]


class Both(in_c.Both):
    """On its way to a posture."""

    def __init__(self, built, goal, lag=0.0, robot=PANDA, **settings):
        super().__init__(built, ftqp.Planner(robot, **settings), lag=lag)
        self.aim(goal)

    def aim(self, goal):
        self.goto = ftqp.GoTo(self.planner, q=goal)
        assert self.arm.call("go_to", numbers(goal)) == 0

    def step(self, stuck=None):
        step, before = self.goto.step(self.q), self.q.copy()
        assert self.arm.call("go", numbers(self.q), None) == step.code, self.steps
        self.moved(step)
        assert STATUSES[self.arm.call("arrived")] is self.goto.status, self.steps
        if stuck is not None:
            self.q[stuck] = before[stuck]
        return step

    def go(self, most=6000, each=lambda k: None, stuck=lambda k: None):
        for k in range(most):
            each(k)
            self.step(stuck(k))
            if self.goto.done:
                break
        return self.goto.status


@pytest.mark.parametrize("lag", [0.0, 0.95])
def test_a_posture_is_reached_as_in_python_with_a_lock_half_way(built, level, lag):
    both = Both(built, AWAY, lag, level=level)

    def fail(k):
        if k == 250:
            both.report(ftqp.Locked(3))

    assert both.go(each=fail) is ftqp.GoToStatus.UNREACHABLE
    others = [i for i in range(7) if i != 3]
    assert np.abs(both.q - AWAY)[others].max() < 1e-3 < abs(both.q - AWAY)[3]


def test_a_healthy_arm_reaches_its_posture_and_goes_back(built, level):
    both = Both(built, AWAY, level=level)
    assert both.go() is ftqp.GoToStatus.REACHED
    both.aim(HOME)
    assert both.go() is ftqp.GoToStatus.REACHED and np.abs(both.q - HOME).max() <= 1e-6


def test_a_joint_that_sticks_unannounced_is_found_and_the_others_arrive(built):
    both = Both(built, AWAY, 0.95)
    place = {}

    def stuck(k):
        place.setdefault("q", both.q.copy() if k == 250 else None)
        return 3 if k >= 250 else None

    assert both.go(stuck=stuck) is ftqp.GoToStatus.UNREACHABLE
    assert set(both.planner.faults) == {"panda_joint4"} and both.arm.call("believed", 3) == LOCKED


ROBOTS = ("iiwa14", {}), ("xarm7", {}), ("modular11", {}), ("planar", {"count": 3}), ("planar", {"count": 12})


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(("name", "options"), ROBOTS)
def test_arms_of_all_kinds_go_anywhere_as_in_python_whatever_fails(built, name, options, seed):
    rng, robot = np.random.default_rng(seed), ftqp.robots.load(name, **options)
    low = np.maximum(robot.limits.q_min, robot.neutral - 2.0)
    high = np.minimum(robot.limits.q_max, robot.neutral + 2.0)
    level, at = ("acceleration", "velocity")[seed % 2], int(rng.integers(600))
    both = Both(built, rng.uniform(low, high), rng.choice([0.0, 0.9]), robot, level=level)

    def change(k):
        joint = int(rng.integers(robot.nv))
        if k == at:
            both.report(ftqp.Locked(joint))
        if k in (at + 300, at + 500):  # to another goal, and then from a motion along its way back
            goal = rng.uniform(low, high)
            both.aim(goal)

    both.go(4000, change)
    assert both.steps > at


def test_a_motor_that_is_too_weak_ends_the_way_sooner(built):
    both = Both(built, HOME + np.array([0.0, 1.2, 0.0, 1.2, 0.0, 0.0, 0.0]))

    def weaken(k):
        if k == 100:
            both.report(ftqp.Degraded(1, torque=0.45))

    assert both.go(9000, weaken) is ftqp.GoToStatus.UNREACHABLE
    assert "panda_joint2 is too weak to hold the arm farther on" in both.goto.sentence


def test_a_stop_halts_the_way_and_resume_lets_it_go_on(built):
    both = Both(built, AWAY)

    def order(k):
        if k in (200, 900):
            what = "stop" if k == 200 else "resume"
            getattr(both.planner, what)()
            assert both.arm.call(what) in (0, 1)
        if k == 800:
            assert both.goto.status is ftqp.GoToStatus.HALTED

    for k in range(4000):
        order(k)
        both.step()
        if both.goto.status is ftqp.GoToStatus.REACHED:
            break
    assert both.goto.status is ftqp.GoToStatus.REACHED and both.steps > 900


def test_no_motion_goes_on_over_a_reset(built):
    both = Both(built, AWAY)
    for _ in range(100):
        both.step()
    assert both.arm.reset(HOME) == 0
    for _ in range(100):
        assert both.arm.step(HOME) == 0
    assert both.arm.call("go", numbers(HOME), None) == 0
    assert np.abs(both.arm.sent("q") - HOME).max() < 1e-5


def test_what_makes_no_posture_or_cannot_be_gone_to_is_answered_by_a_number(built):
    planner = ftqp.Planner(PANDA)
    arm = Library(built, arm_file(planner.deployable(), 7))
    assert arm.open() == 0
    assert arm.call("go", numbers(HOME), None) == arm.call("arrived") == -45
    for q in (HOME + 4.0, np.full(7, np.nan)):
        assert arm.call("go_to", numbers(q)) == -44
    assert arm.call("go_to", None) == -20 and arm.call("has", 7) == 1
    assert arm.call("go_to", numbers(AWAY)) == 0 and arm.call("arrived") == 0
    assert arm.call("go", numbers(HOME), None) == -3 and arm.call("go", None, None) == -20
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(radius=0.05, place=np.array([1.0, 0.0, 0.5])))
    kept = Library(built, arm_file(ftqp.Planner(PANDA, scene=scene).deployable(), 7))
    assert kept.open() == 0 and kept.call("has", 7) == 0
    assert kept.call("go_to", numbers(AWAY)) == -34 and kept.call("go_to", None) == -20
    search, pose = Search(kept), PANDA.pose(AWAY)
    assert kept.call("go_round", None, numbers(AWAY)) == kept.call("go_to_pose", search.at, None) == -20
    assert kept.call("go_round", ctypes.c_void_p(search.at.value + 8), numbers(AWAY)) == -21
    assert kept.call("go_round", search.at, numbers(HOME + 4.0)) == -44
    assert kept.call("go_to_pose", search.at, numbers(2.0 * pose)) == -40
    far = pose.copy()
    far[:3, 3] *= 1000.0  # in millimetres
    assert kept.call("go_to_pose", search.at, numbers(far)) == -44
    assert kept.call("go", numbers(HOME), None) == -45
    assert kept.call("go_to_pose", search.at, numbers(pose)) == 0 and kept.call("arrived") == 0
    assert search.begin(kept, pose) == -3 and kept.call("go", numbers(HOME), None) == -45


class Search:
    """A search for postures in C, and the memory that it has."""

    def __init__(self, arm):
        self.code = arm.code
        self.code.ftqp_search_size.restype = ctypes.c_size_t
        self.room = np.full(self.code.ftqp_search_size() + 64, 255, np.uint8)
        self.at = ctypes.c_void_p(self.room.ctypes.data + -self.room.ctypes.data % 64)

    def begin(self, arm, pose):
        return arm.call("seek", self.at, numbers(pose))

    def find(self, looks, joints):
        q = np.zeros(joints)
        return self.code.ftqp_find(self.at, looks, numbers(q)), q


@pytest.mark.parametrize("rows", ["pose", "position"])
@pytest.mark.parametrize(("name", "options"), (("panda", {}), *ROBOTS))
def test_postures_of_a_pose_are_those_of_python_whatever_has_failed(built, name, options, rows):
    rng, robot = np.random.default_rng(5), ftqp.robots.load(name, **options)
    task = ftqp.Task(rows=robot.default_rows if rows == "pose" else robot.default_rows[:2])
    low, high = np.maximum(robot.limits.q_min, -2.0), np.minimum(robot.limits.q_max, 2.0)
    both = Both(built, robot.neutral, robot=robot, task=task)
    for _ in range(3):
        pose = robot.pose(rng.uniform(low, high))
        ways = Ways(both.planner, goal=pose, tolerance=(1e-3, 5e-3))
        search = Search(both.arm)
        assert search.begin(both.arm, pose) == 0
        for _ in range(200):
            expected, (found, q) = ways.find(200), search.find(200, robot.nv)
            assert found == (0 if expected is None else 1) or (found == -44 and ways.starts == 600)
            if expected is not None:
                np.testing.assert_array_equal(q, expected)
                assert np.linalg.norm((robot.pose(q) - pose)[:2, 3]) < 2e-3
            if found < 0:
                break
        joint = int(rng.integers(robot.nv))
        both.report(ftqp.Locked(joint))


def test_a_pose_is_gone_to_by_a_posture_that_was_found(built):
    both, pose = Both(built, HOME), PANDA.pose(AWAY)
    search = Search(both.arm)
    assert search.begin(both.arm, pose) == 0
    found, goal = search.find(100_000, 7)
    assert found == 1 and np.abs(goal - AWAY).max() > 1e-3
    both.aim(goal)
    assert both.go() is ftqp.GoToStatus.REACHED
    np.testing.assert_allclose(PANDA.pose(both.q), pose, atol=1e-3)


def test_what_no_postures_can_be_looked_for_is_answered_by_a_number(built):
    both, pose = Both(built, HOME), PANDA.pose(AWAY)
    search = Search(both.arm)
    assert search.find(10, 7)[0] == -45 and search.begin(both.arm, 2.0 * pose) == -40
    assert search.find(10, 7)[0] == -45
    assert search.begin(both.arm, pose) == 0 and search.find(0, 7)[0] == -32
    assert both.arm.call("seek", None, numbers(pose)) == both.arm.call("seek", search.at, None) == -20
    far = pose.copy()
    far[0, 3] = 5.0
    assert search.begin(both.arm, far) == 0 and search.find(10**7, 7)[0] == -44
    assert both.arm.call("report", fault_of(2, 2)) == 0 and search.begin(both.arm, pose) == -34
    begun = Library(built, both.arm.file)
    assert begun.open() == 0 and search.begin(begun, pose) == -3


class Round(Both):
    """The same round a wall, by a search in C."""

    def __init__(self, built, goal, keep=0.02):
        planner, self.scene = walled(clearance=ftqp.Clearance(keep=keep, stop=0.0))
        in_c.Both.__init__(self, built, planner, LEFT)
        self.search = Search(self.arm)
        self.aim(goal)

    def aim(self, goal):
        kind, name = ("q", "go_round") if np.ndim(goal) == 1 else ("pose", "go_to_pose")
        self.goto = ftqp.GoTo(self.planner, **{kind: goal})
        assert self.arm.call(name, self.search.at, numbers(goal)) == 0

    def move(self, *place):
        self.scene.move("wall", place)
        T = np.eye(4)
        T[:3, 3] = place
        assert self.arm.call("move", 0, numbers(T), None) == 0


TOO_NEAR = np.append(0.2, LEFT[1:])


@pytest.mark.parametrize("goal", [RIGHT, TOO_NEAR, PANDA.pose(RIGHT), moved(-0.2, 0.1), moved(-0.2, -0.3)])
@pytest.mark.parametrize("joint", [None, 0, 2, 6])
def test_a_goal_beside_a_wall_is_gone_to_as_in_python_with_a_lock_half_way(built, goal, joint):
    both, distances = Round(built, goal), []

    def each(k):
        distances.append(min(map(float, both.planner.distances(both.q).values())))
        if k == 100 and joint is not None:
            both.report(ftqp.Locked(joint))

    status = both.go(4000, each)
    assert min(distances) > 0.01 and both.goto.done
    assert status is ftqp.GoToStatus.REACHED or joint is not None or goal is TOO_NEAR


@pytest.mark.parametrize("place", [(0.6, 0.02, 0.45), (0.6, 0.0, 0.75)])
def test_a_wall_that_moves_has_the_rest_of_the_way_proven_again_as_in_python(built, place):
    both = Round(built, RIGHT)
    both.go(4000, lambda k: both.move(*place) if k == 150 else None)
    assert both.goto.done and both.steps > 150


def test_another_goal_is_gone_to_by_the_same_search_and_a_copy_of_the_planner_has_none(built):
    both = Round(built, RIGHT)
    for goal in (moved(-0.2, -0.3), LEFT):
        both.go(100)
        both.aim(goal)
    assert both.go(4000) is ftqp.GoToStatus.REACHED
    room = np.zeros(both.arm.room.size + 64, np.uint8)
    at = room.ctypes.data + -room.ctypes.data % 64
    ctypes.memmove(at, both.arm.at, both.arm.room.size - 64)
    both.arm.at = at
    assert both.arm.call("go", numbers(LEFT), None) == -45
    assert both.arm.call("go_round", both.search.at, numbers(LEFT)) == 0
    assert both.arm.call("go", numbers(LEFT), None) == 0
