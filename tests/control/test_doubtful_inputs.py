"""What looks like another unit or another place is a warning, and never an error in a loop."""

import logging

import numpy as np
import pinocchio as pin
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
POSE = PANDA.pose(PANDA.neutral)


def moved(x, y=0.0, z=0.0):
    T = POSE.copy()
    T[:3, 3] += x, y, z
    return T


def in_millimetres():
    T = POSE.copy()
    T[:3, 3] *= 1000.0
    return T


def said(caplog, words):
    return [record for record in caplog.records if words in record.getMessage()]


@pytest.fixture(autouse=True)
def heard(caplog):
    caplog.set_level(logging.WARNING, "ftqp")


def run(step, ticks=20):
    q = PANDA.neutral.copy()
    for _ in range(ticks):
        q = step(q).q.copy()
        assert np.isfinite(q).all()


@pytest.mark.parametrize("leader", [lambda planner: planner, ftqp.TargetFollower])
def test_a_target_in_millimetres_is_one_warning(caplog, leader):
    led, target = leader(ftqp.Planner(PANDA)), ftqp.Target(pose=in_millimetres())
    led.reset(PANDA.neutral)
    run(lambda q: led.step(q, None, target))
    assert len(said(caplog, "millimetres")) == 1


@pytest.mark.parametrize("led", [True, False])
def test_a_path_that_starts_354_mm_away_is_one_warning(caplog, led):
    path = ftqp.paths.Circle(moved(-0.25, 0.25), radius=0.05, duration=4.0)
    planner = ftqp.Planner(PANDA, task=ftqp.Task(mode="scaled") if led else None)
    if led:
        follower = ftqp.PathFollower(planner, path)
        follower.reset(PANDA.neutral)
        run(lambda q: follower.step(q, None))
    else:
        planner.reset(PANDA.neutral)
        targets, tick = ftqp.Targets(path.sample(0.001 * np.arange(30)).pose), iter(range(30))
        run(lambda q: planner.step(q, None, targets.at(next(tick))))
    (one,) = said(caplog, "from the end effector")
    assert "354 mm" in one.getMessage() and "GoTo" in one.getMessage()


def test_a_path_that_starts_where_the_arm_is_is_no_warning(caplog):
    planner = ftqp.Planner(PANDA, task=ftqp.Task(mode="scaled"))
    follower = ftqp.PathFollower(planner, ftqp.paths.Circle(POSE, radius=0.05, duration=4.0))
    follower.reset(PANDA.neutral)
    run(lambda q: follower.step(q, None))
    assert not said(caplog, "from the end effector")


def test_a_scene_in_which_the_arm_stands_is_a_warning_that_names_both(caplog):
    robot = PANDA.with_capsules(
        [ftqp.Capsule([0, 0, -0.1], [0, 0, 0.1], 0.06, frame="panda_joint4", name="elbow")]
    )
    place = robot.pose(robot.neutral, "panda_joint4")[:3, 3]
    for where, count in ((place, 1), (place + 5.0, 0)):
        caplog.clear()
        scene = ftqp.Scene()
        scene.add("post", ftqp.Sphere(0.1, where))
        planner = ftqp.Planner(robot, scene=scene)
        planner.reset(robot.neutral)
        found = said(caplog, "the arm starts within")
        assert len(found) == count
        assert all("elbow" in one.getMessage() and "post" in one.getMessage() for one in found)


def test_noise_of_half_a_radian_is_a_warning(caplog):
    ftqp.Noise(q=1e-3)
    assert not caplog.records
    ftqp.Noise(q=0.5)
    assert len(said(caplog, "0.5")) == 1


def test_a_speed_of_80_rad_a_second_is_a_finding():
    found = PANDA.with_limits(v_max=80.0).findings
    assert any("looks like degrees a second" in one.sentence for one in found)
    assert not any("looks like" in one.sentence for one in PANDA.with_limits(v_max=3.0).findings)


def goes_round(planner, far):
    ftqp.PathFollower(planner, ftqp.paths.Circle(POSE, radius=far, duration=4.0))


def stands(planner, far):
    scene = ftqp.Scene()
    scene.add("table", ftqp.Box((0.1, 0.1, 0.1), (far, 0.0, 0.0)))
    ftqp.Planner(PANDA, scene=scene).reset(PANDA.neutral)


@pytest.mark.parametrize(
    ("tell", "far", "sentence"),
    [
        (goes_round, 0.05, "the path goes 99.69 m from the base of an arm that reaches 1.1 m"),
        (lambda planner, far: planner.tool(pin.SE3(np.eye(3), np.array([0.0, 0.0, far])).homogeneous), 0.12,
         "the tool is 120 m long, at the end of an arm that reaches 1.1 m"),
        (lambda planner, far: planner.carry(ftqp.Payload(mass=0.5, com=(0.0, 0.0, far))), 0.05,
         "the centre of mass of the load is 50 m from the end effector"),
        (stands, 0.6, "table is 600 m"),
    ],
)  # fmt: skip
def test_a_length_in_millimetres_is_a_warning(caplog, tell, far, sentence):
    planner = ftqp.Planner(PANDA, task=ftqp.Task(mode="scaled"))
    planner.reset(PANDA.neutral)
    tell(planner, far)
    assert not said(caplog, "millimetres")
    tell(planner, 1000.0 * far)
    (one,) = said(caplog, sentence)
    assert "millimetres" in one.getMessage()


@pytest.mark.parametrize(
    "place", [(0.4, 0.0, 0.3), np.array([0.4, 0.0, 0.3]), (0.4, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0)]
)
def test_a_place_where_a_pose_is_expected_is_answered_with_how_to_make_one(place):
    planner = ftqp.Planner(PANDA)
    planner.reset(PANDA.neutral)
    remedy = (
        r"shape \(\d,\), expected \(4, 4\).* robot.pose\(q\) to keep its rotation, then T\[:3, 3\] = place"
    )
    for mistaken in (lambda: ftqp.GoTo(planner, pose=place), lambda: planner.tool(place)):
        with pytest.raises(ftqp.InputError, match=remedy):
            mistaken()


def test_faults_without_their_times_are_answered_with_a_schedule():
    planner, path = ftqp.Planner(PANDA), ftqp.paths.Circle(POSE, radius=0.05, duration=1.0)
    with pytest.raises(
        ftqp.InputError, match=r"schedule is .*list, expected ftqp.Schedule\(\[ftqp.FaultEvent\(1.0,"
    ):
        ftqp.Simulation(planner, path, q=PANDA.neutral, schedule=[ftqp.Locked(2)])


def test_what_a_console_shows_of_a_planner_s_answers_is_a_line():
    planner = ftqp.Planner(PANDA, drive=ftqp.Drive(takes_velocity=False))
    first = ftqp.connect(planner, PANDA.neutral)
    planner.reset(PANDA.neutral)
    for shown in (first, ftqp.ComputedTorque(PANDA), *planner.ways_out(), *planner.options()):
        text = repr(shown)
        assert text.startswith(f"{type(shown).__name__}(") and len(text) < 400
        assert "\n" not in text and " at 0x" not in text and "array" not in text
