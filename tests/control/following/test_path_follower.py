"""Path followers, and that no limit is passed between the points of a path."""

import numpy as np
import pytest
from tests.going import closed_loop

import ftqp
from ftqp.control.following.path_intervals import path_table
from ftqp.control.following.stall import PATTERNS
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, transform
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.jit import jit
from ftqp.kernel.layout import flat_arrays as layout
from ftqp.kernel.layout.enums import TARGET_SIZE
from ftqp.kernel.rows.path_rows import look_up

PANDA = ftqp.robots.load("panda")
SCALED = ftqp.Task(mode="scaled")
ESCAPE = ftqp.StallEscape()
DT = 2e-3


def follower_of(robot=PANDA, path=None, level="acceleration", task=SCALED, stall=ESCAPE, dt=DT, **settings):
    planner = ftqp.Planner(robot, dt, level=level, task=task, **settings)
    path = (
        ftqp.paths.Circle(robot.pose(robot.neutral), 0.08, duration=2.0, axes=("y", "z"))
        if path is None
        else path
    )
    return ftqp.PathFollower(planner, path, stall=stall)


def run(follower, q=None, longest=8.0):
    """Steps copied, progress, until the path is done."""
    steps, progress = [], [0.0]
    for step in closed_loop(follower, None, round(longest / follower.planner.dt), q):
        steps.append(step.copy())
        progress.append(follower.progress)
        if follower.status is ftqp.PathStatus.DONE:
            break
    return steps, np.array(progress)


def test_arm_that_can_follows_at_full_speed(level):
    follower = follower_of(level=level)
    steps, progress = run(follower)
    assert follower.status is ftqp.PathStatus.DONE and follower.blocked is None
    assert len(steps) * DT == pytest.approx(2.0, abs=0.02)
    assert max(step.position_error for step in steps) < 1e-3
    assert (np.diff(progress) >= 0.0).all() and progress[-1] == 2.0


@pytest.mark.parametrize(("dt", "scheme"), [(5e-3, "mvn"), (1e-3, "rmp"), (5e-3, "dlsm")])
def test_a_path_that_comes_to_rest_ends_whatever_the_scheme_draws_the_joints_to(level, dt, scheme):
    """Near its end the path is so slow that the scheme would gain more by waiting for ever."""
    scheme = ftqp.schemes.dlsm(alpha=0.5) if scheme == "dlsm" else scheme
    path = ftqp.paths.Line(PANDA.pose(PANDA.neutral), [0.0, 0.2, 0.0], duration=2.0)
    follower = follower_of(path=path, level=level, scheme=scheme, dt=dt, stall=None)
    steps, _ = run(follower, longest=2.2)
    assert follower.status is ftqp.PathStatus.DONE
    assert max(step.position_error for step in steps) < 1e-3


@pytest.mark.parametrize("law", ["quintic", "constant"])
def test_path_that_is_too_fast_is_followed_more_slowly_on_the_path(level, law):
    """1.2 m of circle in 0.5 s; the tip stays within 1 mm of the circle and every limit is kept."""
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), 0.2, duration=0.5, axes=("y", "z"), law=law)
    follower = follower_of(path=path, level=level)
    steps, progress = run(follower)
    assert follower.status is ftqp.PathStatus.DONE
    assert len(steps) * DT > 0.6
    limits = PANDA.limits
    for step in steps:
        assert (np.abs(step.v) <= limits.v_max * (1.0 + 1e-9)).all()
        assert (np.abs(step.a) <= limits.a_max * (1.0 + 1e-6)).all()
    centre = path.start[:3, 3] - [0.0, 0.2, 0.0]
    radii = [np.linalg.norm(PANDA.pose(step.q)[:3, 3] - centre) for step in steps[::5]]
    assert np.abs(np.array(radii) - 0.2).max() < 1e-3
    assert (np.diff(progress) >= 0.0).all()


def test_arm_stops_at_the_end_of_a_path_that_ends_at_full_speed(level):
    path = ftqp.paths.Line(PANDA.pose(PANDA.neutral), (0.0, 0.3, 0.0), duration=1.0, law="constant")
    follower = follower_of(path=path, level=level)
    end = path.start[1, 3] + 0.3
    beyond = [PANDA.pose((last := step).q)[1, 3] - end for step in closed_loop(follower, None, 1000)]
    assert follower.status is ftqp.PathStatus.DONE
    assert max(beyond) < 1e-4 and abs(beyond[-1]) < 1e-4
    assert np.abs(last.v).max() < 1e-3


def test_a_path_that_is_done_is_slowed_down_no_more(level):
    path = ftqp.paths.Line(PANDA.pose(PANDA.neutral), (0.1, 0.05, 0.0), duration=1.0)
    follower = follower_of(path=path, level=level)
    steps, _ = run(follower)
    after = closed_loop(follower, None, 200, steps[-1].q, steps[-1].v, reset=False)
    assert {step.status.name for step in after} == {"OK"}, "for 0.3 s an arm at rest said SCALED"
    assert follower.rate > 0.9999


@pytest.mark.long
def test_position_limit_in_the_way_is_named():
    """A joint at its limit, and another locked: the verdict names both."""
    arm = ftqp.robots.load("planar(3)").with_limits(
        q_min=[-3.0, -3.0, -1.2], q_max=[3.0, 3.0, 0.5], v_max=2.0, a_max=20.0
    )
    q = np.array([0.3, 0.8, 0.3])  # towards the second joint: the third has to bend beyond its limit
    elbow = 0.5 * np.array([np.cos(0.3), np.sin(0.3), 0.0])
    path = ftqp.paths.Line(arm.pose(q), 0.5 * (elbow - arm.pose(q)[:3, 3]), duration=3.0)
    follower = follower_of(
        arm, path, "velocity", ftqp.Task(mode="scaled", rows=("x", "y")), dt=0.01, emergency=None
    )
    follower.planner.report(ftqp.Locked(0, mode="instant"))
    run(follower, q, 25.0)
    assert follower.status is ftqp.PathStatus.BLOCKED
    first, last = arm.joints[0], arm.joints[2]
    assert f"{first} (locked)" in follower.blocked
    assert f"{last} (upper position limit)" in follower.blocked


def test_bad_measurement_holds_the_path(level):
    follower = follower_of(level=level)
    *_, step = closed_loop(follower, None, 300)
    before, v, statuses = follower.progress, step.v.copy(), []
    for _ in range(round(1.3 / DT)):  # nothing is heard for longer than a second
        step = follower.step(np.full(7, np.nan), v)
        statuses.append(step.status.name)
        v = step.v.copy()
    assert statuses[0] == "INVALID_INPUT" and statuses[-1] == "STOPPED"
    assert before <= follower.progress < before + 0.2
    assert follower.status is not ftqp.PathStatus.BLOCKED


@pytest.mark.parametrize("mode", ["slack", "hard", "lexicographic"])
def test_other_task_modes_are_refused(mode):
    with pytest.raises(
        InputError, match=rf"leader 'path' does not go with mode '{mode}'.*Task\(mode=\"scaled\"\)"
    ):
        follower_of(task=ftqp.Task(mode=mode))


def test_arm_that_gave_up_its_attitude_rests_within_a_second_of_the_end_of_its_path():
    """The tip is drawn to the attitude at the pace of the task, whatever the scheme would rather do."""
    robot, dt = ftqp.robots.load("xarm7"), 4e-3
    q, v = np.array([-2.786, -1.466, 0.146, 1.84, -4.28, 2.439, -2.151]), np.zeros(7)
    goal = robot.pose(q).copy()
    goal[:3, 3] += [-0.023, 0.273, 0.051]
    goal[:3, :3] = rotation_exp(np.array([-0.131, -0.299, -0.148])) @ goal[:3, :3]
    planner = ftqp.Planner(robot, dt, task=SCALED)
    planner.reset(q)
    planner.report(ftqp.Locked(0, mode="instant"))
    path = ftqp.paths.PointToPoint(robot.pose(q), goal, duration=2.091)
    follower, ended, fastest = ftqp.PathFollower(planner, path), 0, 0.0
    for _ in range(round(6.0 / dt)):
        step = follower.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        ended += follower.status is ftqp.PathStatus.DONE
        if ended > 1.0 / dt:
            fastest = max(fastest, np.abs(v / robot.limits.v_max).max())
    assert ended > 2.0 / dt and len(planner.task_rows) == 3 and step.position_error < 1e-6
    assert fastest < 1e-3


FREE = np.array([False, True, True, False, True])


@pytest.mark.parametrize("pattern", PATTERNS)
def test_pattern_has_no_symmetry_and_unit_size(pattern):
    drive = ftqp.StallEscape().drive(pattern, FREE)
    assert np.abs(drive).max() == pytest.approx(1.0)
    assert drive.any() and not np.allclose(drive, drive[0])


def test_random_pattern_is_that_of_the_seed():
    first, again = (ftqp.StallEscape(seed=3).drive("random", FREE) for _ in range(2))
    other = ftqp.StallEscape(seed=4).drive("random", FREE)
    assert (first == again).all() and not (first == other).all()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"below": 0.0}, "below"),
        ({"below": 0.6}, "expected rates with below < until < 1"),
        ({"until": 1.0}, "expected rates with below < until < 1"),
        ({"patience": -1.0}, "patience"),
        ({"patterns": ("alternate",)}, "did you mean 'alternating'"),
        ({"patterns": ()}, "expected at least one of"),
        ({"seed": -1}, "expected a whole number >= 0"),
    ],
)
def test_wrong_setting_is_one_sentence(settings, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.StallEscape(**settings)


START = transform(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.4, 0.1, 0.5]))
TURNED = transform(np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]), np.array([0.1, 0.3, 0.7]))
POINTS = np.array([[0.4, 0.1, 0.5], [0.5, 0.2, 0.5], [0.5, 0.3, 0.7], [0.3, 0.2, 0.6]])
PATHS = {
    "line": ftqp.paths.Line(START, (0.3, -1.0, 0.2), duration=20.0),
    "constant line": ftqp.paths.Line(START, (0.3, 0.0, 0.2), duration=7.3, law="constant"),
    "trapezoid": ftqp.paths.Line(
        START, (0.3, 0.0, 0.2), duration=3.0, law={"name": "trapezoid", "ramp": 0.17}
    ),
    "circle": ftqp.paths.Circle(START, 0.2, duration=4.0),
    "square": ftqp.paths.Square(START, 0.3, duration=5.0),
    "square at constant speed": ftqp.paths.Square(START, 0.3, duration=5.0, law="constant"),
    "lissajous": ftqp.paths.Lissajous(START, (0.2, 0.1), duration=3.0, law="cycloid"),
    "waypoints": ftqp.paths.Waypoints(START, POINTS, duration=3.7),
    "point to point": ftqp.paths.PointToPoint(START, TURNED, duration=1.9),
}


@jit
def looked_up(path, table, progress, targets):
    """The path's targets at each progress in turn, as the kernel reads them."""
    for k in range(len(progress)):
        path.progress = progress[k]
        look_up(path, table, len(table), targets[k])


def sampled(table, times):
    """The table's pose, twist and acceleration as the kernel reads them."""
    lead, targets = Memory("path", table), np.zeros((len(times), TARGET_SIZE))
    looked_up(lead.fields, lead.table, np.asarray(times, dtype=float), targets)
    return targets[:, :16].reshape(-1, 4, 4), targets[:, 16:22], targets[:, 22:28]


@pytest.mark.parametrize("name", PATHS)
def test_pose_is_within_a_nanometre_everywhere(name):
    path = PATHS[name]
    times = np.concatenate(
        [np.linspace(0.0, path.duration, 1501), np.random.default_rng(0).uniform(0, path.duration, 500)]
    )
    exact = path.sample(times)
    pose, twist, acceleration = sampled(path_table(path), times)
    assert np.abs(pose - exact.pose).max() < 1e-9
    assert np.abs(twist - exact.twist).max() < 1e-7
    smooth = np.abs(acceleration - exact.acceleration).max(axis=1) < 1e-4
    assert smooth.mean() > 0.99, "right of a jump alone the acceleration may be that of its left"


def test_progress_may_be_looked_up_in_any_order():
    path = PATHS["circle"]
    times = np.random.default_rng(1).permutation(np.linspace(0.0, 4.0, 300))
    assert np.abs(sampled(path_table(path), times)[0] - path.sample(times).pose).max() < 1e-9


@pytest.mark.parametrize(
    ("name", "jumps"),
    [
        ("line", []),
        ("circle", []),
        ("constant line", [7.3]),
        ("square at constant speed", [1.25, 2.5, 3.75, 5.0]),
    ],
)
def test_jumps_of_the_twist_are_where_they_are(name, jumps):
    stops = path_table(PATHS[name])[:, layout.STOP]
    np.testing.assert_allclose(np.unique(stops[np.isfinite(stops)]), jumps, atol=1e-7)
