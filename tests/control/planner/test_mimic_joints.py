"""Joints that follow others in a planner: they move with their leaders, and fail with them."""

import numpy as np
import pytest
from tests.going import closed_loop, targets_along
from tests.telescope import telescope

import ftqp

LED = {"lift2": ("lift", 0.5, 0.02), "elbow": ("shoulder", -0.7, 0.3)}


@pytest.fixture(scope="module")
def robot():
    return ftqp.Robot.from_urdf(telescope(), "tool")


def start(robot):
    """A posture in which no joint is near a limit, followers where their leaders put them."""
    q = np.array([0.3, 0.2, 0.0, 0.5, 0.0, 0.2, 0.9, 0.3])
    return robot.chain.ratio * q[robot.chain.lead] + robot.chain.offset


def off_image(robot, q):
    """How far followers are from where their leaders put them."""
    return np.abs(robot.chain.ratio * q[robot.chain.lead] + robot.chain.offset - q).max()


@pytest.mark.parametrize("mode", ["slack", "hard", "scaled", "lexicographic"])
def test_the_tip_follows_a_path_and_every_follower_its_leader(robot, level, mode):
    planner = ftqp.Planner(robot, level=level, task=ftqp.Task("position", mode=mode))
    q, moved = start(robot), np.zeros(robot.nv)
    targets = targets_along(ftqp.paths.Circle(robot.pose(q), radius=0.05, duration=3.0), 1500, DT)
    for step in closed_loop(planner, targets.at, 1500, q):
        assert step.status is ftqp.StepStatus.OK
        assert off_image(robot, step.q) <= 1e-15 and (np.abs(step.v) <= robot.limits.v_max).all()
        moved += np.abs(step.q - q)
        q = step.q.copy()
    assert step.position_error < 1e-4 and moved[[2, 4]].min() > 1e-3
    assert not step.tau[[2, 4]].any() and np.abs(step.tau[3]) > 1.0


@pytest.mark.parametrize("backend", ["active_set", "dtrnn", "quadprog"])
def test_the_least_rates_of_the_motors_are_those_of_the_folded_jacobian(robot, backend):
    planner = ftqp.Planner(robot, level="velocity", task=ftqp.Task("position", mode="hard"), backend=backend)
    q, twist = start(robot), 1e-3 * np.array([2.0, -3.0, 1.0, 0.0, 0.0, 0.0])
    planner.reset(q)
    J = robot.jacobian(q)[:3]
    for name, (leader, ratio, _) in LED.items():  # by hand, from the columns of joints without mimic
        plain = ftqp.Robot.from_pinocchio(robot.model, "tool", acceleration=robot.limits.a_max)
        column = plain.jacobian(q)[:3]
        l, m = robot.joint(leader), robot.joint(name)
        assert J[:, l] == pytest.approx(column[:, l] + ratio * column[:, m], abs=1e-14)
    step = planner.step(q, None, ftqp.Target(pose=robot.pose(q), twist=twist))
    expected = np.linalg.pinv(J) @ twist[:3]
    for name, (leader, ratio, _) in LED.items():
        expected[robot.joint(name)] = ratio * expected[robot.joint(leader)]
    assert step.v == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("mode", ["ramp", "instant"])
def test_a_locked_follower_locks_its_leader_and_the_arm_goes_on(robot, level, mode):
    planner = ftqp.Planner(robot, level=level, task=ftqp.Task("position"))
    q = start(robot)
    line = ftqp.paths.Line(robot.pose(q), displacement=(0.0, 0.08, 0.0), duration=1.0)
    lock = {400: lambda planner: planner.report(ftqp.Locked("elbow", mode=mode))}
    for k, step in enumerate(closed_loop(planner, targets_along(line, 1500, DT).at, 1500, q, events=lock)):
        assert off_image(robot, step.q) <= 1e-15
        if k > 800:
            assert step.v[3] == step.v[4] == 0.0 and step.q[3] == q[3] and step.q[4] == q[4]
        q = step.q.copy()
    assert step.status is ftqp.StepStatus.OK and step.position_error < 1e-4
    assert list(planner.faults) == ["shoulder"]
    planner.withdraw("elbow")
    assert not planner.faults


@pytest.mark.parametrize(
    "says", [lambda q, k: np.nan, lambda q, k: q + 0.05, lambda q, k: q + 0.2 * min(k / 50, 1.0)]
)
def test_the_encoder_of_a_follower_is_looked_at_as_any(robot, says):
    planner = ftqp.Planner(robot, task=ftqp.Task("position"))
    q = start(robot)
    planner.reset(q)
    target = ftqp.Target(position=robot.pose(q)[:3, 3])
    for _ in range(100):
        assert planner.step(q, None, target).status is ftqp.StepStatus.OK
    seen = set()
    for k in range(400):
        wrong = q.copy()
        wrong[4] = says(q[4], k)
        step = planner.step(wrong, None, target)
        seen.add(step.status)
        q = step.q.copy()
    assert not seen <= {ftqp.StepStatus.OK}
    assert step.status is not ftqp.StepStatus.OK


def test_further_tasks_and_kept_points_count_what_a_follower_moves(robot):
    q = start(robot)
    high = robot.pose(q, "roll")[2, 3]
    planner = ftqp.Planner(
        robot,
        tasks=[
            ftqp.Task("position"),
            ftqp.PositionTask("roll", rows="z", target=(0, 0, high - 0.1), name="low", weight=10.0),
        ],
        constraints=[ftqp.Keep("roll", above=[0, 0, high - 0.03])],
    )
    for step in closed_loop(planner, ftqp.Target(pose=robot.pose(q)), 5500, q):
        assert robot.pose(step.q, "roll")[2, 3] >= high - 0.03 - 1e-6
    assert robot.pose(step.q, "roll")[2, 3] == pytest.approx(high - 0.03, abs=1e-3)
    assert step.position_error < 1e-3


def test_a_task_of_a_follower_is_one_of_its_leader_and_a_motion_of_the_joints_takes_both(robot):
    planner = ftqp.Planner(
        robot,
        tasks=[ftqp.Task("position"), ftqp.JointTask({"elbow": 0.1}, weight=10.0)],
    )
    assert planner.tasks["JointTask"].target[3] == pytest.approx((0.1 - 0.3) / -0.7)
    goal = start(robot)
    goal[0], goal[3] = 0.6, 0.2
    goal = robot.chain.ratio * goal[robot.chain.lead] + robot.chain.offset
    for step in closed_loop(ftqp.GoTo(ftqp.Planner(robot), q=goal), None, 3000, start(robot)):
        assert off_image(robot, step.q) <= 1e-15
    assert step.q == pytest.approx(goal, abs=1e-6)


def test_a_joint_with_followers_that_swings_freely_is_refused(robot):
    planner = ftqp.Planner(robot)
    with pytest.raises(ftqp.InputError, match="free-swinging joint needs a motor at every joint"):
        planner.report(ftqp.FreeSwinging("shoulder"))


ROBOT = ftqp.Robot.from_urdf(telescope(), "tool").with_rotors(0.05)
CHAIN = ROBOT.chain
OWN = np.flatnonzero(CHAIN.lead == np.arange(ROBOT.nv))
FOLLOWERS = np.setdiff1d(np.arange(ROBOT.nv), OWN)
DT = 1e-3
NOISE = ftqp.Noise(q=1e-5, tau=0.1)


def coupled(q):
    return CHAIN.ratio * q[CHAIN.lead] + CHAIN.offset


START = coupled(np.array([0.3, 0.2, 0.0, 0.5, 0.0, 0.2, 0.9, 0.3]))


class TorqueArm:
    """What torques of its motors make of the arm, E'M E a + E'h = tau, and a joint that is held fast."""

    def __init__(self, truth=ROBOT):
        self.q, self.v, self.held, self._truth = START.copy(), np.zeros(ROBOT.nv), -1, truth
        self._noise = np.random.default_rng(3)

    def seen(self):
        return self.q + NOISE.q * self._noise.normal(size=ROBOT.nv)

    def move(self, tau, parts=2):
        free = OWN[self.held != OWN]
        for _ in range(parts):
            M, h = self._truth.mass_matrix(self.q), self._truth.bias(self.q, self.v)
            v = np.zeros(ROBOT.nv)
            v[free] = self.v[free] + DT / parts * np.linalg.solve(M[np.ix_(free, free)], (tau - h)[free])
            self.v = CHAIN.ratio * v[CHAIN.lead]
            self.q = coupled(self.q + DT / parts * v)


def followed(planner, arm, ticks=900, at=400, event=None):
    """The largest and the last distance of the true tip from a circle, and all torques."""
    path = ftqp.paths.Circle(ROBOT.pose(START), radius=0.06, duration=3.0)
    targets, places = targets_along(path, ticks, DT), path.sample(DT * np.arange(ticks)).pose[:, :3, 3]
    planner.reset(START)
    off, torques = [], []
    for k in range(ticks):
        if event is not None and k == at:
            event()
        step = planner.step(arm.seen(), None, targets.at(k))
        torques.append(step.tau.copy())
        arm.move(step.tau)
        off.append(float(np.linalg.norm(ROBOT.pose(arm.q)[:3, 3] - places[k])))
    return max(off), off[-1], np.array(torques), step


def torque_planner(**more):
    return ftqp.Planner(ROBOT, DT, task=ftqp.Task("position"), drive="torque", noise=NOISE, **more)


def test_the_leaders_motor_carries_what_its_followers_move():
    planner = torque_planner()
    planner.reset(START)
    step = planner.step(START, None, ftqp.Target(pose=ROBOT.pose(START)))
    weight = ROBOT.bias(START, np.zeros(ROBOT.nv))
    assert step.tau[OWN] == pytest.approx(weight[OWN], rel=1e-9, abs=1e-9)
    assert (step.tau[FOLLOWERS] == 0.0).all()


@pytest.mark.parametrize("fault", [None, "shoulder", "lift"])
def test_the_tip_is_led_by_torques_and_goes_on_when_a_leader_locks(fault):
    planner, arm = torque_planner(), TorqueArm()

    def lock():
        arm.held = ROBOT.joint(fault)
        planner.report(ftqp.Locked(fault, mode="instant"))

    most, last, torques, _ = followed(planner, arm, event=lock if fault else None)
    assert last < 5e-4 and most < (1e-3 if fault is None else 2e-2)
    assert (torques[:, FOLLOWERS] == 0.0).all()
    assert (np.abs(torques[:, OWN]) <= ROBOT.limits.tau_max[OWN]).all()


@pytest.mark.parametrize("joint", ["lift", "shoulder"])
def test_a_detector_names_the_leader_whose_brake_has_closed(joint):
    planner, arm = torque_planner(detector=ftqp.Detector()), TorqueArm()
    _, last, _, _ = followed(planner, arm, event=lambda: setattr(arm, "held", ROBOT.joint(joint)))
    assert list(planner.faults) == [joint] and isinstance(planner.faults[joint], ftqp.Locked)
    assert last < 2e-2


def test_a_detector_of_a_healthy_arm_with_followers_names_none():
    planner = torque_planner(detector=ftqp.Detector())
    most, _, _, _ = followed(planner, TorqueArm(), ticks=1500)
    assert not planner.faults and most < 1e-3
