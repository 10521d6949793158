"""The arm comes to rest where its target stands; regular motion does not notice that it would."""

import logging
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from tests.going import closed_loop, started

import ftqp

DT = 0.002
MODES = ["slack", "hard", "scaled", "lexicographic"]
UP = (0.0, 0.0, 1.0)


class Run:
    """Ticks of one planner in closed loop, and what is kept of them."""

    def __init__(self, robot, start, level="acceleration", dt=DT, **task):
        self.planner = ftqp.Planner(robot, dt, level=level, task=ftqp.Task(**task), emergency=None)
        self.robot, self.dt = robot, dt
        self.q, self.v = np.array(start, dtype=float), np.zeros(robot.nv)
        self.rows = {name: [] for name in ("q", "v", "a", "slack", "status", "position_error")}
        self.planner.reset(self.q)

    def along(self, sample):
        """Follow the samples of a path."""
        targets = ftqp.Targets(sample.pose, sample.twist, sample.acceleration)
        for k in range(len(targets)):
            step = self.planner.step(self.q, self.v, targets.at(k))
            kept = self.q, self.v, step.a.copy(), step.slack.copy(), step.status, step.position_error
            for rows, value in zip(self.rows.values(), kept, strict=True):
                rows.append(value)
            self.q, self.v = step.q.copy(), step.v.copy()
        return self

    def to(self, pose, seconds, moves=2.0):
        """Straight to a pose within ``moves``, where the target then stands."""
        path = ftqp.paths.PointToPoint(self.robot.pose(self.q), pose, duration=moves)
        return self.along(path.sample(self.dt * np.arange(round(seconds / self.dt))))

    def of(self, name, since=0.0):
        """What was kept, from a time on."""
        return np.array(self.rows[name][round(since / self.dt) :])

    def rests(self, since):
        """Whether from that time on every joint is slow, and none at its acceleration limit."""
        speed = np.abs(self.of("v", since)) / self.robot.limits.v_max
        effort = (np.abs(self.of("a", since)) / self.robot.limits.a_max).max(axis=1)
        return speed.max() < 0.01 and np.count_nonzero(effort >= 0.95) * self.dt <= 0.2

    @property
    def holding(self):
        return bool(self.planner.session().K.settling.holding)

    @property
    def error(self):
        return float(self.rows["position_error"][-1])


def moved(robot, q, way=(0.0, 0.0, 0.0), place=None):
    pose = robot.pose(q).copy()
    pose[:3, 3] = pose[:3, 3] + way if place is None else place
    return pose


STRAIGHT = {"iiwa14": np.zeros(7), "planar(4)": np.zeros(4)}
CASES = {
    "panda out": ("panda", None, (0.9, 0.0, 0.0), None),
    "panda out, joint 2 locked": ("panda", None, (0.9, 0.0, 0.0), 1),
    "iiwa out": ("iiwa14", None, (0.6, 0.3, 0.3), None),
    "iiwa out, joint 4 locked": ("iiwa14", None, (0.6, 0.3, 0.3), 3),
    "iiwa straight, 30 cm out": ("iiwa14", STRAIGHT["iiwa14"], (0.0, 0.0, 0.3), None),
    "planar straight, 2 cm out": ("planar(4)", STRAIGHT["planar(4)"], (0.02, 0.0, 0.0), None),
    "planar out, joint 2 locked": ("planar(4)", None, (1.0, 0.5, 0.0), 1),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_an_arm_whose_target_is_out_of_reach_rests_two_seconds_after_it_stands(case, level):
    name, start, way, locked = case
    robot = ftqp.robots.load(name)
    run = Run(robot, robot.neutral if start is None else start, level)
    if locked is not None:
        run.planner.report(ftqp.Locked(locked))
    run.to(moved(robot, run.q, way), 6.0)
    assert run.rests(4.0) and run.holding
    assert run.error > 1e-3


@pytest.mark.parametrize("mode", MODES[1:])
def test_it_rests_in_every_mode(mode, level):
    robot = ftqp.robots.load("panda")
    run = Run(robot, robot.neutral, level, mode=mode).to(moved(robot, robot.neutral, (0.9, 0.2, 0.0)), 6.0)
    assert run.rests(4.0) and run.holding


@pytest.mark.parametrize("dt", [0.001, 0.005, 0.01])
def test_it_rests_at_every_sampling_period(dt, level):
    robot = ftqp.robots.load("iiwa14")
    run = Run(robot, robot.neutral, level, dt=dt).to(moved(robot, robot.neutral, (0.6, 0.3, 0.3)), 6.0)
    assert run.rests(4.0) and run.holding


def test_without_calm_it_swings(level):
    robot = ftqp.robots.load("iiwa14")
    run = Run(robot, robot.neutral, level, calm=False).to(moved(robot, robot.neutral, (0.6, 0.3, 0.3)), 6.0)
    assert not run.rests(4.0) and not run.holding


@pytest.mark.parametrize(("name", "way"), [("iiwa14", (0.0, 0.0, -0.15)), ("planar(4)", (-0.15, 0.0, 0.0))])
def test_a_start_that_is_exactly_singular_is_left(name, way, level):
    robot = ftqp.robots.load(name)
    run = Run(robot, STRAIGHT[name], level, rows=None if name != "iiwa14" else "position")
    run.to(moved(robot, run.q, way), 7.0)
    assert run.error < 1e-3 and not run.holding and run.rests(5.0)


@pytest.mark.parametrize("name", ["iiwa14", "srs7"])
def test_a_joint_pressed_against_its_range_does_not_keep_the_arm_from_resting(name, level):
    robot = ftqp.robots.load(name)
    top = robot.pose(np.zeros(7))[2, 3]
    run = Run(robot, robot.neutral, level).to(moved(robot, robot.neutral, place=(0.0, 0.0, top - 0.05)), 6.0)
    assert run.rests(4.0)


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
def test_a_regular_path_does_not_change_by_a_bit(name, level):
    robot = ftqp.robots.load(name)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.08, duration=3.0)
    calm, plain = (
        Run(robot, robot.neutral, level, calm=on).along(path.sample(DT * np.arange(1800)))
        for on in (True, False)
    )
    for name in ("q", "v", "a", "slack", "status"):
        np.testing.assert_array_equal(calm.of(name), plain.of(name))


def test_a_path_by_a_wrist_alignment_is_followed_as_well_but_for_three_tenths(level):
    robot = ftqp.robots.load("iiwa14")
    start = np.array([0.0, 0.6, 0.0, -1.4, 0.0, 0.12, 0.0])
    path = ftqp.paths.Circle(robot.pose(start), radius=0.08, duration=4.0)
    calm, plain = (
        Run(robot, start, level, calm=on).along(path.sample(DT * np.arange(2000))) for on in (True, False)
    )
    assert calm.of("position_error").max() <= 1.3 * plain.of("position_error").max()


def chain(n, length):
    """A straight chain of n joints that turn about its own direction and across it in turn."""
    text = '<robot name="chain"><link name="l0"/>'
    for i in range(n):
        text += f"""<joint name="j{i + 1}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>
        <origin xyz="0 0 {length if i else 0.0}"/><axis xyz="{"0 1 0" if i % 2 else "0 0 1"}"/>
        <limit lower="-2.6" upper="2.6" velocity="2" effort="400"/></joint>
        <link name="l{i + 1}"><inertial><origin xyz="0 0 {length / 2}"/><mass value="0.4"/>
        <inertia ixx="4e-4" iyy="4e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
    return ftqp.Robot.from_urdf(text + "</robot>", tip=f"l{n}", acceleration=np.full(n, 10.0))


def test_self_motions_of_a_long_arm_that_lags_behind_its_target_are_no_saddles():
    """Feedback alone follows 2 mm behind; kicks along self-motions would throw the arm about."""
    robot = chain(16, 0.1875)
    i = np.arange(16)
    start = 1.8 * np.where(i % 2, 0.12, 0.15) * np.where(i % 4 < 2, 1.0, 0.6)
    path = ftqp.paths.PointToPoint(robot.pose(start), moved(robot, start, (0.0, 0.025, 0.0)), duration=0.8)
    sample = path.sample(DT * np.arange(500))
    run = Run(robot, start, kp=2500.0, kv=100.0)
    run.along(replace(sample, twist=np.zeros((500, 6)), acceleration=np.zeros((500, 6))))
    assert 1e-3 < run.of("position_error").max() < 3e-3
    assert np.abs(run.of("a")).max() < 3.0


def stands(planner, pose, q, ticks):
    """The last step towards a target that stands."""
    *_, last = closed_loop(planner, ftqp.Target(pose=pose), ticks, q, reset=False)
    return last.copy()


def test_a_hold_is_said_once_and_ends_when_the_target_moves(caplog):
    robot = ftqp.robots.load("panda")
    planner = started(robot, DT, emergency=None)
    far = moved(robot, robot.neutral, (0.9, 0.0, 0.0))
    with caplog.at_level(logging.INFO, logger="ftqp"):
        step = stands(planner, far, robot.neutral, 1500)
        assert step.holding and step.status is ftqp.StepStatus.RELAXED
        warned, *said = caplog.records
        assert warned.levelno == logging.WARNING and "first target is 900 mm" in warned.message
        assert [r.message.startswith("holding, out of reach by") for r in said] == [True]
        step = stands(planner, robot.pose(robot.neutral), step.q, 1500)
    assert not step.holding and step.status is ftqp.StepStatus.OK and step.position_error < 1e-4
    assert len(caplog.records) == 3 and "no longer holding" in caplog.records[2].message


def test_a_hold_ends_when_another_joint_fails_and_the_arm_rests_again():
    robot = ftqp.robots.load("panda")
    run = Run(robot, robot.neutral).to(moved(robot, robot.neutral, (0.9, 0.0, 0.0)), 4.0)
    assert run.holding
    run.planner.report(ftqp.Locked(1))
    still = ftqp.paths.Hold(moved(robot, robot.neutral, (0.9, 0.0, 0.0)), duration=5.0)
    run.along(still.sample(DT * np.arange(50)))
    assert not run.holding
    run.along(still.sample(DT * np.arange(1500)))
    assert run.holding


@pytest.mark.parametrize("backend", ["dtrnn", "daqp"])
def test_every_backend_rests_as_the_kernel_does(backend):
    robot = ftqp.robots.load("planar(4)")
    steps = []
    for name in ("active_set", backend):
        planner = started(robot, 0.01, backend=name, emergency=None)
        far = moved(robot, robot.neutral, (1.0, 0.5, 0.0))
        steps.append(stands(planner, far, robot.neutral, 500))
    assert steps[0].holding and steps[1].holding
    np.testing.assert_allclose(steps[1].q, steps[0].q, atol=1e-6)


def test_noise_does_not_wake_an_arm_that_holds():
    robot, rng = ftqp.robots.load("iiwa14"), np.random.default_rng(0)
    planner = started(robot, DT, emergency=None)
    target = ftqp.Target(pose=moved(robot, robot.neutral, (0.6, 0.3, 0.3)))
    q, v = robot.neutral.copy(), np.zeros(7)
    held = []
    for _ in range(2500):
        step = planner.step(q + rng.normal(0.0, 1e-4, 7), v + rng.normal(0.0, 1e-3, 7), target)
        q, v = q + DT * v + 0.5 * DT * DT * step.a, v + DT * step.a
        held.append(step.holding)
    assert all(held[-1000:])
    assert np.abs(v).max() < 0.01


PATHS = {
    "panda out of reach": ("panda", (0.0, 0.0, 0.36), None),
    "iiwa, joint 6 locked": ("iiwa14", (0.04, 0.08, 0.04), 5),
    "xarm7, joint 4 locked": ("xarm7", (0.08, 0.16, 0.08), 3),
    "planar out of reach": ("planar(4)", (0.35, 0.35, 0.0), None),
}


@pytest.mark.parametrize("case", PATHS.values(), ids=PATHS)
def test_a_path_that_cannot_go_on_is_blocked_within_a_second_of_its_stall_and_the_arm_rests(case, level):
    name, way, locked = case
    robot = ftqp.robots.load(name)
    task = ftqp.Task(mode="scaled", degrade=())
    planner = ftqp.Planner(robot, DT, level=level, task=task, emergency=None)
    way = 2.0 * np.array(way) if locked is None else np.array(way)
    follower = ftqp.PathFollower(planner, ftqp.paths.Line(robot.pose(robot.neutral), way, duration=3.0))
    fails = {} if locked is None else {round(1.0 / DT): lambda planner: planner.report(ftqp.Locked(locked))}
    rates, efforts = [], []
    steps = closed_loop(follower, None, round(8.0 / DT), events=fails)
    for step in steps:
        rates.append(follower.rate)
        efforts.append(np.abs(step.a / robot.limits.a_max).max())
        if follower.status is ftqp.PathStatus.BLOCKED:
            break
    assert len(rates) < 6.0 / DT
    slow = np.array(rates) < 0.01
    assert 0.3 < np.count_nonzero(slow) * DT < 1.0
    assert np.count_nonzero(np.array(efforts)[slow] >= 0.95) * DT < 0.25
    progress, speeds = [], []
    for step in islice(steps, round(2.0 / DT)):
        progress.append(follower.progress)
        speeds.append(np.abs(step.v / robot.limits.v_max).max())
    assert follower.status is ftqp.PathStatus.BLOCKED and progress[0] == progress[-1]
    assert max(speeds[round(1.0 / DT) :]) < 0.01 and step.position_error < 5e-3


@pytest.mark.parametrize("start", [0.0, 0.1])
def test_a_stall_that_a_self_motion_can_pass_is_passed(start, level):
    """Bedrossian's third manoeuvre, with calm: the roll joints lead the arm past the singularity."""
    robot = ftqp.robots.load("modular11").with_limits(v_max=np.deg2rad(50.0), a_max=np.deg2rad(250.0))
    q = np.deg2rad([start, -50.0, start, -30.0, -start, 70.0, 0.0, 30.0, start, 0.0, 0.0])
    planner = ftqp.Planner(robot, 0.01, level=level, task=ftqp.Task(mode="scaled"), emergency=None)
    path = ftqp.paths.Line(robot.pose(q), (-2.54, 0.0, 0.0), duration=20.0, law="constant")
    follower = ftqp.PathFollower(planner, path)
    for joint in (1, 3, 6):
        planner.report(ftqp.Locked(joint, mode="instant"))
    for step in closed_loop(follower, None, 2200, q):
        assert step.status is not ftqp.StepStatus.FALLBACK and step.position_error < 2e-3
    assert follower.status is ftqp.PathStatus.DONE


def ended(robot, level, way, law):
    """A line from neutral, followed until 2 s after its end or its verdict.

    Returns the follower; statuses, largest speed (share of its limit) and largest distance from the end [m]
    in the last second; how long the path stood, and how long of that at an acceleration limit [s].
    """
    planner = ftqp.Planner(robot, DT, level=level, task=ftqp.Task(mode="scaled"), emergency=None)
    path = ftqp.paths.Line(robot.pose(robot.neutral), way, duration=3.0, law=law)
    follower = ftqp.PathFollower(planner, path)
    steps, stood, strained = closed_loop(follower, None, round(60.0 / DT)), 0, 0
    for step in steps:
        stands = follower.rate < 0.01 and follower.progress > 0.0
        stood += stands
        strained += stands and np.abs(step.a / robot.limits.a_max).max() >= 0.95
        if follower.status in (ftqp.PathStatus.BLOCKED, ftqp.PathStatus.DONE):
            break
        assert DT * stood < 2.0
    end, statuses, speeds, errors = path.sample([3.0]).pose[0], [], [], []
    for step in islice(steps, round(1.0 / DT), round(2.0 / DT)):
        statuses.append(step.status)
        speeds.append(np.abs(step.v / robot.limits.v_max).max())
        errors.append(np.linalg.norm(robot.pose(step.q)[:3, 3] - end[:3, 3]))
    return follower, set(statuses), max(speeds), max(errors), DT * stood, DT * strained


@pytest.mark.long
@pytest.mark.parametrize("name, out", [("panda", (0.0, 0.0, 1.0)), ("planar(4)", (0.7, 0.7, 0.0))])
def test_the_arm_rests_at_the_end_of_its_path_and_before_an_end_just_out_of_reach(name, out, level):
    robot = ftqp.robots.load(name)
    out = np.array(out) / np.linalg.norm(out)
    far = 2.0 * robot.length
    reach = far * ended(robot, level, far * out, "constant")[0].progress / 3.0
    for law in ("quintic", "constant"):
        follower, statuses, speed, error, _, _ = ended(robot, level, (reach - 1e-3) * out, law)
        assert follower.status is ftqp.PathStatus.DONE and statuses == {ftqp.StepStatus.OK}
        assert speed < 0.01 and error < 1e-5
        for beyond in (5e-4, 2e-2):
            follower, _, speed, error, stood, strained = ended(robot, level, (reach + beyond) * out, law)
            assert follower.status is ftqp.PathStatus.BLOCKED
            assert 0.3 < stood < 1.0 and strained < 0.25
            assert speed < 0.01 and error < beyond + 2e-3
