"""An arm whose joints are all held for a while, as by a protective stop, is let go without a leap."""

import numpy as np
import pytest
from tests.going import closed_loop, started, targets_along

import ftqp
from ftqp.control.planner.status import StepStatus
from ftqp.model import catalog

DT, AT = 1e-3, 0.8
PANDA = catalog.load("panda")
URDF = """<robot name="stranger"><link name="base"/>{}</robot>"""
LINK = """<link name="l{i}"><inertial><origin xyz="0 0 0.1"/><mass value="1.5"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{i}" type="revolute"><parent link="{p}"/><child link="l{i}"/><origin xyz="0 0 0.22"/>
<axis xyz="{axis}"/><limit lower="-2.6" upper="2.6" velocity="2.6" effort="90"/></joint>"""
AXES = ("0 0 1", "0 1 0", "0 0 1", "0 1 0", "0 0 1", "0 1 0", "1 0 0")


def stranger(folder):
    """An arm of nobody's catalog."""
    links = (LINK.format(i=i, p=f"l{i - 1}" if i else "base", axis=axis) for i, axis in enumerate(AXES))
    file = folder / "stranger.urdf"
    file.write_text(URDF.format("".join(links)), encoding="utf-8")
    return ftqp.Robot.from_urdf(file, tip="l6")


class Arm:
    """Joints behind a servo: of second order, or of first order where it takes velocities."""

    def __init__(self, robot, drive="position", w=50.0, fed=True):
        self.robot, self.drive, self.w, self.fed = robot, drive, w, fed
        self.q, self.v = robot.neutral.copy(), np.zeros(robot.nv)

    def move(self, step, held):
        before, w = self.q, self.w
        if held:
            self.v = np.zeros(self.robot.nv)
            return 0.0
        if self.drive == "torque":
            bias = self.robot.bias(self.q, self.v)
            self.v = self.v + DT * np.linalg.solve(self.robot.mass_matrix(self.q), step.tau - bias)
        elif self.drive == "velocity":
            self.v = self.v + (step.v - self.v) * -np.expm1(-w * DT)
        else:
            fed = step.v if self.fed else 0.0
            self.v = self.v + DT * (w * w * (step.q - self.q) - 2.0 * w * (self.v - fed))
        self.q = self.q + DT * self.v
        return float((np.abs(self.q - before) / DT / self.robot.limits.v_max).max())


def circle(radius):
    """A circle of the Panda, gone round in 3 s."""
    return ftqp.paths.Circle(PANDA.pose(PANDA.neutral), radius=radius, duration=3.0)


def leader(planner, kind, path, goal):
    if kind == "clock":
        last = round(path.duration / DT)
        targets = targets_along(path, last + 1, DT)
        return lambda q, k: planner.step(q, None, targets.at(min(k, last)))
    if kind == "path":
        follower = ftqp.PathFollower(planner, path)
        return lambda q, k: follower.step(q)
    if kind == "goto":
        way = ftqp.GoTo(planner, pose=goal)
        return lambda q, k: way.step(q)
    led = ftqp.TargetFollower(planner, ftqp.TipLimits(speed=0.25))
    return lambda q, k: led.step(q, None, ftqp.Target(pose=goal))


def motion(robot, kind, hold, drive="position", w=50.0, fed=True, noise=0.0, seconds=None, stated=True):
    """The steps' statuses, the fastest joint after the hold, what was asked of brakes, and the error [m]."""
    start = robot.pose(robot.neutral)
    path, goal = ftqp.paths.Circle(start, radius=0.05, duration=3.0), start.copy()
    goal[:3, 3] += [-0.1, 0.15, -0.1]
    takes = ftqp.Drive(takes_velocity=fed) if drive == "position" else drive
    task = ftqp.Task(mode="scaled") if kind == "path" else None
    planner = started(robot, drive=takes, task=task, noise=ftqp.Noise(q=noise if stated else 0.0))
    tick, arm = leader(planner, kind, path, goal), Arm(robot, drive, w, fed)
    rng, said, fastest, brakes, leads = np.random.default_rng(1), [], 0.0, False, []
    for k in range(int((AT + hold + 8.0 if seconds is None else seconds) / DT)):
        step = tick(arm.q + rng.normal(0.0, noise, robot.nv) if noise else arm.q, k)
        speed = arm.move(step, AT <= k * DT < AT + hold)
        fastest = max(fastest, speed if k * DT >= AT + hold else 0.0)
        said.append(step.status)
        brakes = brakes or bool(step.brakes.any())
        leads.append(float(np.abs(step.q - arm.q).max()))
    end = path.sample([path.duration]).pose[0] if kind in ("clock", "path") else goal
    error = float(np.linalg.norm(robot.pose(arm.q)[:3, 3] - end[:3, 3]))
    return said, fastest, brakes, error, leads, planner


@pytest.mark.long
@pytest.mark.parametrize("kind", ["clock", "path", "target", "goto"])
@pytest.mark.parametrize(
    ("hold", "w", "fed"),
    [
        (1.0, 20.0, True),
        (0.1, 300.0, False),
        pytest.param(0.1, 20.0, True, marks=pytest.mark.slow),
        pytest.param(1.0, 300.0, False, marks=pytest.mark.slow),
    ],
)
def test_arm_that_was_held_goes_on_without_a_leap_and_finishes(kind, hold, w, fed):
    _, fastest, brakes, error, _, planner = motion(PANDA, kind, hold, w=w, fed=fed)
    assert fastest < 1.1
    assert error < 2e-3 and planner.stopped_because is None
    assert not brakes and not planner.faults


@pytest.mark.parametrize(
    ("drive", "hold"),
    [("velocity", 1.0), ("torque", 0.1), pytest.param("torque", 1.0, marks=pytest.mark.slow)],
)
def test_held_arm_on_other_drives_asks_for_no_brake_and_finishes(drive, hold):
    said, fastest, brakes, error, _, planner = motion(PANDA, "clock", hold, drive)
    assert StepStatus.HELD in said
    assert fastest < 1.1 and error < 2e-3
    assert not brakes and planner.stopped_because is None


@pytest.mark.parametrize("hold", [0.1, *(pytest.param(hold, marks=pytest.mark.slow) for hold in (1.0, 9.0))])
def test_hold_of_a_torque_arm_that_goes_to_a_target_comes_before_its_encoders_are_doubted(hold):
    said, fastest, brakes, error, _, planner = motion(PANDA, "target", hold, "torque")
    assert said.index(StepStatus.HELD) * DT < AT + 0.02
    assert not set(said) & {StepStatus.STOPPING, StepStatus.STOPPED}
    assert fastest < 1.1 and error < 2e-3
    assert not brakes and planner.stopped_because is None


@pytest.mark.parametrize("hold", [0.3, *(pytest.param(hold, marks=pytest.mark.slow) for hold in (0.0, 3.0))])
def test_target_is_reached_behind_a_slow_servo_that_nobody_told_of(hold):
    _, fastest, _, error, _, planner = motion(PANDA, "target", hold, w=20.0, fed=False)
    assert planner.stopped_because is None
    assert fastest < 1.1 and error < 2e-3


@pytest.mark.parametrize("dt", [0.02, 0.025, 0.04])
def test_hold_is_said_within_a_few_samples_of_a_slow_loop(dt):
    planner, arm, said = started(PANDA, dt=dt), Arm(PANDA, w=20.0), []
    targets = targets_along(circle(0.05), round(3.0 / dt) + 1, dt)
    for k in range(round(2.0 / dt)):
        step = planner.step(arm.q, None, targets.at(k))
        for _ in range(round(dt / DT)):
            arm.move(step, k * dt >= AT)
        said.append(step.status)
    assert AT < said.index(StepStatus.HELD) * dt < AT + 4.5 * dt


def turning(told, w, speed, locks=2.0, seconds=0.75):
    """A Panda that turns about its base, whose first joint locks then, unannounced, behind a servo.

    How far the tip falls behind [m], the fastest joint, the largest lead of the first joint [rad], statuses.
    """
    planner, arm = started(PANDA, drive=ftqp.Drive(bandwidth=told)), Arm(PANDA, w=w)
    begin, ramp, said = PANDA.pose(PANDA.neutral), 0.5, set()
    angle = fastest = behind = lead = 0.0
    for k in range(round(seconds / DT)):
        s = min(1.0, k * DT / ramp)
        rate, change = speed * s * s * (3.0 - 2.0 * s), speed * 6.0 * s * (1.0 - s) / ramp
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        pose = turn @ begin
        x, y = pose[:2, 3]
        twist = np.array([-rate * y, rate * x, 0.0, 0.0, 0.0, rate])
        bends = np.array([-rate * twist[1], rate * twist[0], 0.0, 0.0, 0.0, 0.0])
        acceleration = np.array([-change * y, change * x, 0.0, 0.0, 0.0, change]) + bends
        step = planner.step(arm.q, None, ftqp.Target(pose=pose, twist=twist, acceleration=acceleration))
        locked, fast = arm.q[0], arm.move(step, False)
        if k * DT >= locks:
            arm.q[0], arm.v[0] = locked, 0.0
        fastest, said = max(fastest, fast), said | {step.status}
        angle += DT * (rate + 0.5 * DT * change)
        behind = max(behind, float(np.linalg.norm(PANDA.pose(arm.q)[:2, 3] - pose[:2, 3])))
        lead = max(lead, abs(step.q[0] - arm.q[0]))
    return behind, fastest, lead, said


def test_joint_near_its_speed_limit_falls_no_farther_behind_by_a_bound_of_its_lead():
    told, untold = turning(20.0, 20.0, 3.85), turning(None, 20.0, 3.85)
    assert max(told[0], untold[0]) < 7e-3
    assert told[1] > 0.94 and told[3] == {StepStatus.OK}


def test_command_leads_a_joint_that_locks_by_no_more_than_its_known_servo_explains():
    _, _, lead, said = turning(94.0, 94.0, 3.5, locks=0.6, seconds=1.2)
    assert StepStatus.LAGGING in said
    assert lead < 2.7 * 2.0 * PANDA.limits.v_max[0] / 94.0  # its lag, and until it is named


def creeping(v, step=0.0, noise=0.0, seconds=3.0, stated=True):
    """How often an arm is called held whose first two joints go at v [rad/s], seen in steps of an encoder."""
    arm, rng, held = Arm(PANDA, w=40.0), np.random.default_rng(3), 0
    planner = ftqp.Planner(PANDA, noise=ftqp.Noise(q=noise if stated else 0.0))
    ways = np.array([v, v, 0.0, 0.0, 0.0, 0.0, 0.0])

    def seen():
        q = step * np.round(arm.q / step) if step else arm.q
        return q + rng.normal(0.0, noise, PANDA.nv) if noise else q

    planner.reset(seen())
    for k in range(round(seconds / DT)):
        one = planner.step(seen(), None, ftqp.Target(pose=PANDA.pose(PANDA.neutral + ways * k * DT)))
        arm.move(one, False)
        held += one.status is StepStatus.HELD
    return held


@pytest.mark.long
@pytest.mark.parametrize("v", [0.02, pytest.param(0.05, marks=pytest.mark.slow), 0.1])
@pytest.mark.parametrize(("step", "noise"), [(0.0, 0.0), (1e-3, 0.0), (2e-3, 0.0), (0.0, 1e-4), (0.0, 1e-3)])
@pytest.mark.parametrize("stated", [True, False])
def test_arm_that_goes_slowly_is_not_held_however_coarse_its_encoders(v, step, noise, stated):
    assert creeping(v, step, noise, stated=stated) == 0


def test_hold_is_said_soon_and_ends_when_the_arm_follows_again():
    said, _, _, _, leads, _ = motion(PANDA, "clock", 1.0)
    first, last = said.index(StepStatus.HELD), len(said) - 1 - said[::-1].index(StepStatus.HELD)
    assert AT < first * DT < AT + 0.06
    assert AT + 1.0 <= last * DT < AT + 1.1
    assert set(said[first : last + 1]) == {StepStatus.HELD}
    assert max(leads[round((AT + 0.5) / DT) : round((AT + 1.0) / DT)]) < 0.02


@pytest.mark.parametrize("fed", [True, False])
@pytest.mark.parametrize(("noise", "stated"), [(1e-4, True), (1e-4, False), (6e-4, False)])
def test_arm_of_a_stranger_with_noise_is_held_and_let_go(tmp_path, fed, noise, stated):
    """Whether or not anybody said how noisy its encoders are."""
    given = {"fed": fed, "noise": noise, "stated": stated}
    said, fastest, brakes, error, _, planner = motion(stranger(tmp_path), "clock", 1.0, **given)
    assert StepStatus.HELD in said
    assert fastest < (1.1 if noise < 6e-4 else 1.2)  # what was learned in 0.8 s from so much noise is little
    assert error < 2e-3 and planner.stopped_because is None and not brakes


def test_stop_of_a_held_arm_is_resumed():
    planner, arm, fastest = started(PANDA), Arm(PANDA), 0.0
    targets = targets_along(circle(0.05), 3001, DT)
    for k in range(8000):
        if k == 1200:
            planner.stop()
        if k == 3000:
            assert planner.resume()
        step = planner.step(arm.q, None, targets.at(min(k, 3000)))
        fastest = max(fastest, arm.move(step, 800 <= k < 2000))
        if 1300 <= k < 3000:
            assert step.status in (StepStatus.STOPPING, StepStatus.STOPPED)
    assert step.status is StepStatus.OK and step.position_error < 1e-3 and fastest < 1.1


def paused(since, until):
    """A stop of the planner at a tick, resumed at another."""

    def resume(planner):
        assert planner.resume()

    return {since: lambda planner: planner.stop(), until: resume}


@pytest.mark.parametrize(
    ("drive", "mode"),
    [("position", "slack"), ("position", "hard"), ("velocity", "scaled"), ("torque", "lexicographic")],
)
def test_stopped_arm_goes_on_along_the_path_of_the_clock_and_does_not_race(drive, mode):
    planner = ftqp.Planner(PANDA, DT, drive=drive, task=ftqp.Task(mode=mode))
    s, targets = circle(0.1).sample(DT * np.arange(3001)), targets_along(circle(0.1), 3001, DT)
    tips = []
    for step in closed_loop(planner, lambda k: targets.at(min(k, 3000)), 8000, events=paused(1000, 2000)):
        tips.append(PANDA.pose(step.q)[:3, 3])
    far = max(np.linalg.norm(s.pose[:, :3, 3] - p, axis=1).min() for p in tips[::20])
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / DT
    assert speeds[2000:].max() < 1.3 * np.linalg.norm(s.twist[:, :3], axis=1).max()  # 3.5 times, when chased
    assert far < 0.01 and step.status is StepStatus.OK and step.position_error < 1e-3


def test_goal_that_is_given_to_a_stopped_arm_is_gone_to_at_once_and_makes_nothing_late():
    path = ftqp.paths.Line(PANDA.pose(PANDA.neutral), [0.1, 0.0, 0.0], duration=2.0)
    targets = targets_along(path, 2001, DT)
    # another goal comes while the arm stands, and the path from its begin once the arm is there
    given = lambda k: targets.at(k if k < 2000 else 0 if k < 4000 else k - 4000)  # noqa: E731
    steps = closed_loop(ftqp.Planner(PANDA), given, 6000, events=paused(1000, 2500))
    errors = [step.position_error for step in steps]
    assert all(np.diff(errors[2510:3500]) < 1e-6)
    assert max(errors[4000:]) < 1e-3


def test_locked_joint_is_no_held_arm():
    planner, arm, held = started(PANDA), Arm(PANDA), 0
    targets = targets_along(circle(0.1), 3001, DT)
    for k in range(2500):
        step = planner.step(arm.q, None, targets.at(k))
        locked = arm.q[3]
        arm.move(step, False)
        if k >= 800:
            arm.q[3], arm.v[3] = locked, 0.0
        held += step.status is StepStatus.HELD
    assert held == 0
