"""Going to postures and poses: what holds on the way, where the arm rests, and what is said."""

import numpy as np
import pinocchio as pin
import pytest
from tests.going import DT, closed_loop, go, planner_at, within_limits
from tests.servo_arm import ServoArm, TorqueArm

import ftqp
from ftqp.core.pose import rotation_x

PANDA = ftqp.robots.load("panda")
HOME = PANDA.neutral
AWAY = HOME + np.array([0.5, -0.3, 0.4, 0.3, -0.5, 0.6, 0.3])


def test_posture_is_met_to_a_microradian_with_limited_jerk(level):
    goto = ftqp.GoTo(planner_at(AWAY, level), q=HOME)
    steps = go(goto, AWAY)
    assert goto.status is ftqp.GoToStatus.REACHED and goto.sentence == goto.status.value
    assert np.abs(steps[-1].q - HOME).max() <= 1e-6
    assert {step.status for step in steps} == {ftqp.StepStatus.OK}
    v = np.array([step.v for step in steps])
    jerk = np.abs(np.diff(v, n=2, axis=0)) / DT**2
    assert (jerk <= 1.05 * PANDA.limits.a_max / 0.05).all()


def test_way_to_a_posture_is_as_fast_as_the_slowest_joint_allows():
    """A joint that goes 2 rad at v_max = 2.175 rad/s and a_max in 50 ms."""
    start = HOME.copy()
    start[0] = 2.0
    goto = ftqp.GoTo(planner_at(start), q=HOME)
    steps = go(goto, start)
    v_max, a_max = PANDA.limits.v_max[0], PANDA.limits.a_max[0]
    least = 2.0 / v_max + v_max / a_max + 0.05
    arrival = next(k for k, step in enumerate(steps) if abs(step.q[0] - HOME[0]) < 1e-4) * DT
    assert least <= arrival <= least + 0.15


def test_jerk_limit_of_a_joint_is_kept_on_the_way_to_a_posture() -> None:
    start = HOME.copy()
    start[0] = 2.0
    j_max = np.array([20.0, *[np.inf] * (PANDA.nv - 1)])
    robot = PANDA.with_limits(j_max=j_max)
    planner = ftqp.Planner(robot, dt=DT)
    planner.reset(start)
    steps = go(ftqp.GoTo(planner, q=HOME), start)
    assert abs(steps[-1].q[0] - HOME[0]) < 1e-3
    jerk = np.abs(np.diff([step.a[0] for step in steps])) / DT
    assert 10.0 < jerk.max() <= 20.0 * (1.0 + 1e-6)


@pytest.mark.parametrize("settings", [
    {"scheme": "mtn"}, {"scheme": "pseudoinverse", "level": "velocity"}, {"backend": "osqp"},
    {"task": ftqp.Task(mode="scaled")}, {"task": ftqp.Task(mode="lexicographic")},
    {"task": ftqp.Task(mode="hard")},
])  # fmt: skip
def test_every_planner_goes_to_a_posture_and_steps_on_as_before(settings):
    planner = planner_at(AWAY, **settings)
    goto = ftqp.GoTo(planner, q=HOME)
    steps = go(goto, AWAY)
    assert goto.status is ftqp.GoToStatus.REACHED
    target = ftqp.Target(pose=PANDA.pose(HOME))
    after = planner.step(steps[-1].q, steps[-1].v, target).copy()
    fresh = planner_at(HOME, **settings)
    fresh.reset(steps[-1].q, steps[-1].v)
    assert np.abs(after.q - fresh.step(steps[-1].q, steps[-1].v, target).q).max() < 1e-8


@pytest.mark.parametrize(
    ("at", "fault"),
    [
        (0, ftqp.Locked("panda_joint4")),
        (30, ftqp.Locked("panda_joint1", mode="instant")),
        (90, ftqp.Locked("panda_joint4")),
        (145, ftqp.Locked("panda_joint1", mode="instant")),
    ],
)
def test_joint_that_fails_at_any_phase_leaves_the_others_to_reach_their_place(level, at, fault):
    goto = ftqp.GoTo(planner_at(AWAY, level), q=HOME)
    steps = go(goto, AWAY, each=lambda k: k == at and goto.planner.report(fault))
    failed = PANDA.joint(fault.joint)
    others = [i for i in range(7) if i != failed]
    assert np.abs(steps[-1].q - HOME)[others].max() <= 1e-6
    assert (np.abs(steps[-1].v) < 1e-3 * PANDA.limits.v_max).all()
    missed = abs(steps[-1].q[failed] - HOME[failed])
    if missed > 1e-3:
        assert goto.status is ftqp.GoToStatus.UNREACHABLE
        assert f"{fault.joint} (locked) by {missed:.3g} rad" in goto.sentence
        assert goto.joint_error[failed] == pytest.approx(HOME[failed] - steps[-1].q[failed], abs=1e-9)
        assert f"{1e3 * goto.position_error:.3g} mm" in goto.sentence
    else:
        assert goto.status is ftqp.GoToStatus.REACHED


def gravity_share(planner, steps):
    """Largest shares of a torque limit: what holds the arm at rest, by pinocchio, and what was sent."""
    model, limit = planner.robot.model, PANDA.limits.tau_max
    data = model.createData()
    held = [np.abs(pin.computeGeneralizedGravity(model, data, step.q)) / limit for step in steps[::10]]
    return np.max(held), max(float((np.abs(step.tau) / limit).max()) for step in steps)


def test_step_of_a_motion_of_the_joints_says_what_holds_it_back():
    goto, said = ftqp.GoTo(planner_at(HOME), q=AWAY), []
    q = HOME
    for k in range(600):
        if k == 40:
            goto.planner.report(ftqp.Degraded("panda_joint2", torque=0.3))
        step = goto.step(q)
        q = step.q.copy()
        said += [str(step.certificate)] * (step.status is ftqp.StepStatus.RELAXED)
    assert any(one.startswith("the motion of the joints is held back by panda_joint2 at") for one in said)


STRETCHED = np.array([0.0, 1.47, 0.0, -0.2, 0.0, 1.6, 0.8])


@pytest.mark.long
def test_load_taken_up_on_the_way_shortens_it_and_laying_it_down_lets_it_go_on():
    planner = planner_at(HOME)
    goto = ftqp.GoTo(planner, q=STRETCHED)

    def each(k):
        if k == 20:
            planner.carry(ftqp.Payload(8.0))

    steps = go(goto, HOME, each=each)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE
    held, sent = gravity_share(planner, steps[20:])
    assert 0.9 < held <= 0.985 and sent <= 1.0 + 1e-9
    planner.carry(None)
    steps = go(goto, steps[-1].q, steps[-1].v)
    assert goto.status is ftqp.GoToStatus.REACHED and np.abs(steps[-1].q - STRETCHED).max() <= 1e-6


def test_repaired_joint_goes_on_to_its_place():
    planner = planner_at(AWAY)
    planner.report(ftqp.Locked(3, mode="instant"))
    goto = ftqp.GoTo(planner, q=HOME)
    steps = go(goto, AWAY)
    planner.withdraw(3)
    steps = go(goto, steps[-1].q)
    assert goto.status is ftqp.GoToStatus.REACHED and np.abs(steps[-1].q - HOME).max() <= 1e-6


def test_continuous_joint_goes_the_short_way_round():
    robot = ftqp.robots.load("planar", lengths=(0.4, 0.4, 0.4), continuous=True)
    robot = robot.with_limits(v_max=2.0, a_max=10.0)
    start, goal = np.array([3.0, 0.0, 0.5]), np.array([-3.0, 0.2, 0.5])
    planner = planner_at(start, robot=robot)
    goto = ftqp.GoTo(planner, q=goal)
    steps = go(goto, start)
    assert goto.status is ftqp.GoToStatus.REACHED
    assert steps[-1].q[0] == pytest.approx(2.0 * np.pi - 3.0, abs=1e-6)


@pytest.mark.parametrize("shift, turn", [((0.1, 0.1, -0.1), 0.0), ((-0.15, 0.2, 0.1), 0.6)])
def test_pose_is_reached(level, shift, turn):
    goal = PANDA.pose(HOME) @ rotation_of(turn)
    goal[:3, 3] += shift
    goto = ftqp.GoTo(planner_at(HOME, level), pose=goal)
    steps = go(goto, HOME)
    assert goto.status is ftqp.GoToStatus.REACHED and within_limits(steps)
    assert goto.position_error < 1e-4 and goto.rotation_error < 5e-4
    assert goto.joint_error is None


def rotation_of(angle):
    result = np.eye(4)
    result[:3, :3] = rotation_x(angle)
    return result


@pytest.mark.long
@pytest.mark.parametrize("rows", ["pose", "position"])
def test_pose_out_of_reach_is_neared_as_far_as_can_be_and_the_arm_rests_and_says_so(level, rows):
    """The emergency stop of 5 cm is on; a planner without one that is given the goal at once ends as near."""
    goal = PANDA.pose(HOME)
    goal[:3, 3] += [0.5, 0.5, 0.5]
    task = ftqp.Task(rows=rows)
    goto = ftqp.GoTo(planner_at(HOME, level, task=task), pose=goal)
    steps = go(goto, HOME, longest=20.0)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and within_limits(steps)
    assert f"{1e3 * goto.position_error:.3g} mm" in goto.sentence
    *_, step = closed_loop(goto, None, 500, steps[-1].q, steps[-1].v, reset=False)
    assert (np.abs(step.v) < 1e-3 * PANDA.limits.v_max).all()
    assert goto.status is ftqp.GoToStatus.UNREACHABLE
    alone = planner_at(HOME, level, task=task, emergency=None)
    *_, step = closed_loop(alone, ftqp.Target(pose=goal), 1500)
    least = np.linalg.norm(goal[:3, 3] - PANDA.pose(step.q)[:3, 3])
    assert goto.position_error < least + 0.01


def test_wrong_goals_are_refused_in_a_sentence():
    planner = planner_at(HOME)
    outside = HOME.copy()
    outside[3] = 1.0
    for wrong, says in (
        ({}, "exactly one"),
        ({"q": HOME, "pose": np.eye(4)}, "exactly one"),
        ({"q": HOME[:3]}, "q has shape"),
        ({"q": np.full(7, np.nan)}, "NaN"),
        ({"q": outside}, "panda_joint4 at 1, outside its limits.* choose a posture inside them$"),
        ({"q": np.rad2deg(HOME)}, r"are these degrees\?"),
        ({"pose": np.eye(4), "limits": 0.25}, r"limits is 0\.25, expected ftqp\.TipLimits"),
        ({"pose": np.zeros((4, 4))}, "not a rotation"),
        ({"q": HOME, "rise_time": 0.0}, "rise_time"),
        ({"q": HOME, "limits": ftqp.TipLimits()}, "leave them out"),
        ({"pose": np.eye(4), "tolerance": -1.0}, "tolerance"),
    ):
        with pytest.raises(ftqp.InputError, match=says):
            ftqp.GoTo(planner, **wrong)


def test_planner_without_a_start_is_refused_at_the_first_step():
    for goal in ({"q": HOME}, {"pose": np.eye(4)}):
        goto = ftqp.GoTo(ftqp.Planner(PANDA), **goal)
        with pytest.raises(ftqp.InputError, match="reset"):
            goto.step(HOME, np.zeros(7))


def test_joint_that_swings_free_on_the_way_does_not_stop_the_others(level):
    goto = ftqp.GoTo(planner_at(AWAY, level), q=HOME)
    free = ftqp.FreeSwinging("panda_joint7", damping=2.0)
    steps = go(goto, AWAY, each=lambda k: k == 50 and goto.planner.report(free))
    assert np.abs(steps[-1].q - HOME)[:6].max() <= 1e-6
    assert {step.tau[6] for step in steps[52:]} == {0.0}
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and "panda_joint7 (free-swinging) by" in goto.sentence


@pytest.mark.parametrize(
    ("of", "drive", "takes"),
    [
        ("posture", "position", "position only"),
        ("pose", "velocity", "velocity"),
        ("pose", "position", "position"),
        ("posture with a lock", "position", "position"),
        ("posture with a lock", "velocity", "velocity"),
    ],
)
def test_arm_behind_a_servo_of_15_hz_goes_to_its_goal(drive, takes, of):
    goal = {"pose": PANDA.pose(HOME)} if of == "pose" else {"q": HOME}
    planner = planner_at(AWAY, drive=drive)
    goto = ftqp.GoTo(planner, **goal)
    arm = ServoArm(AWAY, DT, takes=takes)
    for k in range(1500):
        if "lock" in of and k == 60:
            planner.report(ftqp.Locked(3))
            arm.braked[3] = True
        step = goto.step(arm.measured(), None)
        assert step.status not in (ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED)
        arm.command(step)
        if goto.done:
            break
    for _ in range(100):
        arm.command(goto.step(arm.measured(), None))
    if of == "pose":
        assert goto.status is ftqp.GoToStatus.REACHED
        assert np.abs(PANDA.pose(arm.q) - PANDA.pose(HOME)).max() < 1e-3
    else:
        locked = "lock" in of
        assert goto.status is (ftqp.GoToStatus.UNREACHABLE if locked else ftqp.GoToStatus.REACHED)
        assert np.abs(np.delete(arm.q - HOME, 3)).max() < 1e-3


def test_torque_arm_goes_to_its_pose_while_it_learns_the_load_of_which_nobody_told():
    """Every look at the load was news for which the way was looked for anew: the arm stood for good."""
    goto = ftqp.GoTo(planner_at(AWAY, drive="torque"), pose=PANDA.pose(HOME))
    arm, rng = TorqueArm(PANDA, AWAY, DT, mass=1.0), np.random.default_rng(2)
    for _ in range(2000):
        arm.command(goto.step(arm.q + 1e-5 * rng.standard_normal(7), None))
        if goto.done:
            break
    assert goto.status is ftqp.GoToStatus.REACHED, goto.sentence


def test_speed_slows_the_way_down_even_half_way_there():
    goto = ftqp.GoTo(planner_at(AWAY), q=HOME)

    def slower(k):
        if k == round(0.2 / DT):
            goto.planner.speed = 0.1

    steps = go(goto, AWAY, longest=40.0, each=slower)
    share = np.array([np.abs(step.v / PANDA.limits.v_max).max() for step in steps])
    assert goto.status is ftqp.GoToStatus.REACHED and np.abs(steps[-1].q - HOME).max() <= 1e-6
    assert share[: round(0.2 / DT)].max() > 0.5
    assert 0.09 < share[round(0.6 / DT) :].max() <= 0.1


def test_a_halt_says_why_in_its_sentence():
    goto = ftqp.GoTo(planner_at(AWAY), q=HOME)
    go(goto, AWAY, each=lambda k: k == 50 and goto.planner.stop())
    assert goto.status is ftqp.GoToStatus.HALTED
    assert goto.planner.stopped_because in goto.sentence and "says why" not in goto.sentence
    follower = ftqp.TargetFollower(planner_at(HOME))
    target = ftqp.Target(pose=PANDA.pose(HOME))
    follower.step(HOME, np.zeros(7), target)
    planner = goto.planner
    planner.resume()
    assert follower.sentence == follower.status.value
