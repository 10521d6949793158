"""Ways round obstacles: proven free, the same whatever the slices, from rest to rest within the limits."""

import numpy as np
import pytest
from tests.going import go

import ftqp
from ftqp.control.planner.ways.ways import Ways
from ftqp.kernel.layout.ways_room import WayStage

PANDA = ftqp.robots.load("panda")
DT = 4e-3
LEFT, RIGHT = np.array([0.9, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8]), np.array([-0.9, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8])
"""The hand on both sides of a wall."""


def moved(x=0.0, y=0.0, z=0.0):
    """The pose of the tip on the left, moved along W."""
    pose = PANDA.pose(LEFT).copy()
    pose[:3, 3] += x, y, z
    return pose


def commands(goto, each=lambda k: None, start=LEFT):
    """Commands of all ticks behind three of the start, and shares of speed, acceleration and jerk."""
    rows = np.array([start] * 4 + [step.q for step in go(goto, start, longest=25.0, each=each)])
    limits = PANDA.limits
    tops = limits.v_max, limits.a_max, limits.a_max / 0.05
    return rows, *(np.abs(np.diff(rows, n=k + 1, axis=0)) / DT ** (k + 1) / tops[k] for k in range(3))


def walled(start=LEFT, **given):
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box(size=(0.6, 0.04, 0.9), place=(0.6, 0.0, 0.45)))
    planner = ftqp.Planner(PANDA, DT, scene=scene, **given)
    planner.reset(start)
    return planner, scene


def thought(planner, looks=50, **goal):
    ways = Ways(planner, LEFT, **goal)
    while ways.is_searching:
        ways.search_step(looks)
    return ways


def least(planner, rows):
    return min(float(d.min()) for d in planner.distances(np.array(rows)).values())


def test_posture_behind_a_wall_is_gone_to_and_nothing_comes_nearer_than_is_kept():
    planner, _ = walled()
    assert least(planner, np.linspace(LEFT, RIGHT, 60)) < 0.0
    goto = ftqp.GoTo(planner, q=RIGHT)
    steps = go(goto, LEFT, longest=20.0)
    assert goto.status is ftqp.GoToStatus.REACHED
    assert np.abs(steps[-1].q - RIGHT).max() < 1e-6
    assert least(planner, [step.q for step in steps]) > 0.5 * 0.02
    assert {step.status for step in steps} <= {ftqp.StepStatus.OK, ftqp.StepStatus.RELAXED}


@pytest.mark.parametrize("goal", [
    {"goals": [RIGHT]}, {"goal": PANDA.pose(RIGHT)}, {"goal": moved(-0.2, 0.1), "straight": ftqp.TipLimits()},
])  # fmt: skip
def test_slices_of_any_size_give_the_same_way_bit_for_bit(goal):
    motions = [thought(walled()[0], looks, **goal).motion for looks in (50, 150, 500)]
    assert len(motions[0]) > 50
    assert all(np.array_equal(motions[0], motion) for motion in motions[1:])


def test_joints_that_move_both_bodies_of_a_pair_do_not_count_in_the_proof_of_an_edge():
    planner = ftqp.Planner(PANDA, DT, clearance=ftqp.Clearance(keep=2e-3, stop=0.0))
    planner.reset(LEFT)
    assert least(planner, [LEFT]) < 0.01  # of links 5 and 7
    for joints in ([0], [0, 1], [0, 1, 2, 3, 4]):
        ways = Ways(planner, LEFT, goals=[LEFT + 0.3 * np.isin(np.arange(7), joints)])
        assert ways.has_way and ways.looks < 50


def test_edges_that_are_proven_are_clear_everywhere_by_three_quarters_of_what_is_kept():
    planner, _ = walled(clearance=ftqp.Clearance(keep=1e-2, stop=0.0))
    random, free, near = np.random.default_rng(7), 0, np.inf
    while free < 40:
        goal = np.clip(LEFT + random.uniform(-0.8, 0.8, 7), PANDA.limits.q_min, PANDA.limits.q_max)
        ways = Ways(planner, LEFT, goals=[goal])
        if ways.goes_straight:
            free += 1
            near = min(near, least(planner, np.linspace(LEFT, goal, 300)))
    assert 0.75e-2 - 1e-4 < near < 1.5e-2


def test_motion_begins_and_ends_at_rest_within_speed_acceleration_and_jerk():
    planner, _ = walled()
    ways = thought(planner, goals=[RIGHT])
    assert ways.stage is WayStage.READY and ways.is_free
    q, limits = ways.motion, planner.view().limits
    v = np.diff(q, axis=0) / DT
    a, jerk = np.diff(v, axis=0) / DT, np.diff(v, n=2, axis=0) / DT**2
    assert (np.abs(v) <= limits.v).all()
    assert (np.abs(a) <= limits.a * (1.0 + 1e-6)).all()
    assert (np.abs(jerk) <= 1.02 * limits.a / 0.05).all()
    np.testing.assert_allclose(q[[0, -1]], [LEFT, RIGHT], atol=1e-9)
    assert np.abs(v[[0, -1]]).max() < 0.02
    assert least(planner, q) > 0.5 * 0.02


@pytest.mark.parametrize("keep", [2e-3, 2e-2])
@pytest.mark.parametrize("goal", [{"q": RIGHT}, {"pose": PANDA.pose(RIGHT)}, {"pose": moved(-0.2, -0.3)}])
def test_commands_beside_a_wall_keep_speed_acceleration_and_jerk_by_their_differences(goal, keep):
    planner, _ = walled(clearance=ftqp.Clearance(keep=keep, stop=0.0))
    goto = ftqp.GoTo(planner, **goal)
    rows, v, a, jerk = commands(goto)
    assert goto.status is ftqp.GoToStatus.REACHED, goto.sentence
    assert v.max() <= 1.0 and a.max() <= 0.99 + 1e-6 and jerk.max() <= 1.02
    assert least(planner, rows) > 0.5 * keep


def test_tip_goes_straight_beside_a_wall_as_fast_as_it_may_and_no_faster():
    limits, goal = ftqp.TipLimits(speed=0.2, acceleration=1.0), moved(-0.2, 0.1)
    goto, notes = ftqp.GoTo(walled()[0], pose=goal, limits=limits), set()
    rows, *_ = commands(goto, lambda k: notes.add(goto.note))
    assert goto.status is ftqp.GoToStatus.REACHED and notes == {"the end effector goes straight"}
    p = np.array([PANDA.pose(q)[:3, 3] for q in rows])
    along = (goal[:3, 3] - p[0]) / np.linalg.norm(goal[:3, 3] - p[0])
    off = (p - p[0]) - np.outer((p - p[0]) @ along, along)
    assert np.linalg.norm(off, axis=1).max() < 1e-3
    v = np.linalg.norm(np.diff(p, axis=0), axis=1) / DT
    assert 0.18 < v.max() <= 0.202
    assert np.linalg.norm(np.diff(p, n=2, axis=0), axis=1).max() / DT**2 <= 1.05


def test_lock_on_the_way_is_gone_on_from_at_speed_and_without_a_jump():
    planner, _ = walled()
    goto = ftqp.GoTo(planner, pose=moved(-0.2, 0.1))
    rows, v, _, jerk = commands(goto, lambda k: k == 80 and planner.report(ftqp.Locked(6, mode="instant")))
    assert goto.status is ftqp.GoToStatus.REACHED, goto.sentence
    assert np.delete(jerk, 6, axis=1).max() <= 1.02
    assert v[83:-90].max(axis=1).min() > 0.03
    assert len(rows) > 200 and (rows[84:, 6] == rows[84, 6]).all()


@pytest.mark.parametrize(
    "mode, joint, at",
    [("instant", 3, 134), ("instant", 1, 160), ("ramp", 3, 134), ("ramp", 1, 121), ("ramp", 1, 110)],
)
def test_joints_brake_beside_a_table_with_bounded_jerk_where_one_locks_on_a_proven_motion(mode, joint, at):
    scene, down = ftqp.Scene(), moved()
    down[2, 3] = 0.1
    scene.add("table", ftqp.Box(size=(2.0, 2.0, 0.1), place=(0.3, 0.0, -0.01)))
    planner = ftqp.Planner(PANDA, DT, scene=scene, clearance=ftqp.Clearance(stop=0.0))
    planner.reset(LEFT)
    goto = ftqp.GoTo(planner, pose=down)
    lock = ftqp.Locked(joint, mode=mode)
    rows, _, _, jerk = commands(goto, lambda k: k == at and planner.report(lock))
    assert np.delete(jerk, joint, axis=1).max() <= 1.02 and least(planner, rows) > 0.5 * 0.02


def test_fast_hand_is_slowed_down_from_as_far_away_as_rows_would_hold_it_back():
    scene, start = ftqp.Scene(), np.array([1.5, 1.2, 1.0, -0.5, 0.0, 1.8, 0.8])
    scene.add("wall", ftqp.Box(size=(1.2, 0.04, 1.4), place=(0.5, -0.75, 0.6)))
    planner = ftqp.Planner(PANDA, DT, scene=scene, clearance=ftqp.Clearance(keep=2e-3, stop=0.0))
    planner.reset(start)
    planner.report(ftqp.Locked(3, mode="instant"))
    goal = np.array([-0.54, 1.2, -0.7, -0.5, 0.0, 1.8, 0.8])
    goto = ftqp.GoTo(planner, q=goal)
    *_, jerk = commands(goto, start=start)
    assert goto.status is ftqp.GoToStatus.REACHED and jerk.max() <= 1.02


def test_motion_stays_slow_for_as_long_as_its_mean_is_over_behind_where_it_was_slowest():
    planner, _ = walled(clearance=ftqp.Clearance(keep=2e-3, stop=0.0))
    ways = thought(planner, goals=[RIGHT])
    W = ways.W
    top, ds = np.array(W.top[: W.grid]), np.array(W.ds[: W.grid])
    k = int(top.argmin())
    behind = np.cumsum(ds[k:]) < W.rise * np.sqrt(top[k])
    assert behind.sum() > 1 and (top[k:][behind] == top[k]).all()
    assert top[k:].max() > 2.0 * top[k]


def test_joint_that_is_locked_elsewhere_is_named_where_the_others_have_gone_to_a_posture():
    planner, _ = walled()
    planner.report(ftqp.Locked("panda_joint7", mode="instant"))
    goal = LEFT + np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.4])
    goto = ftqp.GoTo(planner, q=goal)
    steps = go(goto, LEFT)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE
    assert "panda_joint7 (locked) by 0.4 rad" in goto.sentence
    assert np.abs(steps[-1].q - goal)[:6].max() < 1e-6


def test_wall_that_comes_meanwhile_is_gone_round():
    planner, scene = walled()
    scene.remove("wall")
    goto = ftqp.GoTo(planner, q=RIGHT)

    def each(k):
        if k == 20:
            scene.add("wall", ftqp.Box(size=(0.6, 0.04, 0.9), place=(0.6, 0.0, 0.45)))

    steps = go(goto, LEFT, longest=25.0, each=each)
    assert goto.status is ftqp.GoToStatus.REACHED
    assert least(planner, [step.q for step in steps]) > 0.5 * 0.02


@pytest.mark.parametrize("angle", [0.0, 0.2, 0.36])  # in the wall, with a corner in it, 12 mm away
def test_goal_posture_too_near_to_an_obstacle_names_it_and_is_neared_within_acceleration_and_jerk(angle):
    goal = np.append(angle, LEFT[1:])
    planner, _ = walled()
    assert least(planner, [goal]) < 0.013
    goto = ftqp.GoTo(planner, q=goal)
    rows, v, a, jerk = commands(goto)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE
    assert "nearer than 20 mm to wall" in goto.sentence
    assert v.max() <= 1.0 and a.max() <= 0.99 + 1e-6 and jerk.max() <= 1.02
    assert 0.0199 < least(planner, rows[-1:]) < 0.0203 and least(planner, rows) > 0.5 * 0.02
    assert np.linalg.norm(rows[-1] - goal) < 0.9 * (0.4 - angle)  # from where the first joint alone would go


def test_nearest_posture_to_a_goal_that_is_too_near_may_be_behind_the_obstacle():
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box(size=(1.2, 0.04, 2.4), place=(0.76, 0.0, 1.2)))
    planner = ftqp.Planner(PANDA, DT, scene=scene)
    planner.reset(LEFT)
    goto = ftqp.GoTo(planner, q=RIGHT)
    rows, _, _, jerk = commands(goto)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and jerk.max() <= 1.02
    assert "panda_link1 is nearer than 20 mm to wall" in goto.sentence
    assert np.linalg.norm(rows[-1] - RIGHT) < 0.05 and least(planner, rows) > 0.5 * 0.02


@pytest.mark.parametrize("goal", [{"q": RIGHT}, {"pose": PANDA.pose(RIGHT)}])
def test_arm_that_begins_too_near_to_an_obstacle_is_led_away_within_acceleration_and_jerk(goal):
    start = np.append(0.36, LEFT[1:])
    planner, _ = walled(start)
    before = least(planner, [start])
    assert 0.01 < before < 0.013
    goto = ftqp.GoTo(planner, **goal)
    rows, v, a, jerk = commands(goto, start=start)
    assert goto.status is ftqp.GoToStatus.REACHED
    assert v.max() <= 1.0 and a.max() <= 0.99 + 1e-6 and jerk.max() <= 1.02
    assert least(planner, rows) > before - 5e-4


@pytest.mark.parametrize("goal", [{"q": RIGHT}, {"pose": PANDA.pose(RIGHT)}])
def test_clear_goal_that_no_way_leads_to_is_neared_within_acceleration_and_jerk(goal):
    planner, _ = walled()
    for joint in (1, 3):
        planner.report(ftqp.Locked(joint, mode="instant"))
    assert least(planner, [RIGHT]) > 0.02
    goto = ftqp.GoTo(planner, **goal)
    rows, v, a, jerk = commands(goto)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and "no way round was found in" in goto.sentence
    assert v.max() <= 1.0 and a.max() <= 0.99 + 1e-6 and jerk.max() <= 1.02
    off = [np.linalg.norm(PANDA.pose(q)[:3, 3] - PANDA.pose(RIGHT)[:3, 3]) for q in rows[[0, -1]]]
    assert off[1] < off[0] - 0.05 and least(planner, rows) > 0.5 * 0.02


def test_goal_pose_inside_an_obstacle_names_the_body_and_the_arm_goes_as_near_as_it_gets():
    planner, _ = walled()
    inside = np.array([0.0, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8])
    goto = ftqp.GoTo(planner, pose=PANDA.pose(inside))
    rows, _, _, jerk = commands(goto)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and jerk.max() <= 1.02
    assert "starts is clear: most often panda_link3 is nearer than 20 mm to wall" in goto.sentence
    assert np.abs(PANDA.pose(rows[-1])[1, 3]) < 0.2 and least(planner, rows) > 0.5 * 0.02


@pytest.mark.parametrize("goal, locked", [(moved(0.6, 0.5), []), (moved(-0.2, 0.2, 0.3), [3, 5])])
def test_goal_without_a_posture_is_neared_by_one_motion_within_acceleration_and_jerk(goal, locked):
    planner, _ = walled()
    for joint in locked:
        planner.report(ftqp.Locked(joint, mode="instant"))
    goto = ftqp.GoTo(planner, pose=goal)
    rows, v, a, jerk = commands(goto)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and goto.position_error > 0.01
    assert goto.sentence.endswith("no posture was found in 600 starts")
    assert v.max() <= 1.0 and a.max() <= 0.99 + 1e-6 and jerk.max() <= 1.02
    assert (np.abs(rows[-1] - LEFT) > 0.01).any() and least(planner, rows) > 0.5 * 0.02


def test_any_joint_may_stop_dead_on_the_way_and_the_others_brake_before_the_wall():
    planner, _ = walled(clearance=ftqp.Clearance(keep=2e-3, stop=0.0))
    motion = thought(planner, goals=[RIGHT]).motion
    v, limits = np.gradient(motion, DT, axis=0), planner.view().limits
    for k in range(0, len(motion), 5):
        for joint in range(7):
            rest = np.where(np.arange(7) == joint, 0.0, v[k])
            end = motion[k] + rest * np.abs(rest) / (2.0 * limits.a)
            assert least(planner, [end]) > 0.0, (k, joint)


def test_pose_just_out_of_reach_has_a_posture_within_the_tolerances_and_none_without():
    arm = ftqp.robots.load("planar", lengths=(0.5, 0.3))
    planner = ftqp.Planner(arm, DT)
    planner.reset([0.3, 0.4])
    goal = arm.pose([1.0, 0.0])
    goal[:2, 3] *= 0.8005 / 0.8
    for tolerance, postures in (((1e-3, 1.0), True), ((1e-6, 1.0), False)):
        ways = Ways(planner, goal=goal, rows=("x", "y"), tolerance=tolerance)
        while ways.is_searching:
            ways.search_step(500)
        assert (ways.stage is WayStage.READY) == postures
    assert ways.sentence == "no posture was found in 600 starts"


def test_tip_that_is_within_its_tolerances_behind_a_motion_of_the_joints_is_not_led_any_farther():
    arm, scene = ftqp.robots.load("planar", lengths=(0.5, 0.3)), ftqp.Scene()
    scene.add("post", ftqp.Sphere(0.05, (-0.5, 0.0, 0.0)))
    planner = ftqp.Planner(arm, DT, task=ftqp.Task(rows=("x", "y")), scene=scene)
    planner.reset([0.3, 0.4])
    goal = arm.pose([1.0, 0.0])
    goal[:2, 3] *= 0.8005 / 0.8
    goto = ftqp.GoTo(planner, pose=goal)
    steps = go(goto, [0.3, 0.4], longest=10.0)
    assert goto.status is ftqp.GoToStatus.REACHED and 4e-4 < goto.position_error < 1e-3
    assert len(steps) < 600  # 1,056 where the tip then went on straight


def test_arm_that_begins_inside_a_box_names_it_and_is_led_out_and_on():
    scene = ftqp.Scene()
    tip = PANDA.pose(LEFT)[:3, 3]
    scene.add("box", ftqp.Box(size=(0.3, 0.3, 0.1), place=tip - [0.0, 0.0, 0.035]))
    planner = ftqp.Planner(PANDA, DT, scene=scene)
    planner.reset(LEFT)
    goto, said = ftqp.GoTo(planner, pose=moved(-0.15, -0.2, 0.1)), []
    go(goto, LEFT, longest=10.0, each=lambda k: said.append(goto.sentence))
    assert "and box overlap by 28 mm" in said[1] and "overlap" not in said[-1]
    assert goto.status is ftqp.GoToStatus.REACHED


def test_path_is_followed_in_thought_up_to_the_wall():
    planner, scene = walled()
    line = np.tile(PANDA.pose(LEFT), (101, 1, 1))
    line[:, 1, 3] += np.linspace(0.0, PANDA.pose(RIGHT)[1, 3] - line[0, 1, 3], 101)
    for free in (False, True):
        if free:
            scene.remove("wall")
        ways = Ways(planner, path=line, leap=np.full(7, 0.3), rows="position")
        ways.begin_following(LEFT, 0)
        while not ways.follow(50):
            assert 0 <= ways.followed <= 100
        assert (ways.followed == 100) == free
    assert np.abs(PANDA.pose(ways.at)[:3, 3] - line[-1, :3, 3]).max() < 1e-6


def test_way_in_a_tube_keeps_the_tip_where_it_is():
    planner = ftqp.Planner(PANDA, DT)
    planner.reset(LEFT)
    here = PANDA.pose(LEFT)
    ways = Ways(planner, path=here[None], leap=np.ones(7), tube=here[None])
    while (node := ways.explore(50)) is None or np.abs(ways.place(node) - LEFT).max() < 0.5:
        assert ways.looks < 40_000
    ways.lead_to(node)
    while ways.is_searching:
        ways.search_step(50)
    off = [np.linalg.norm(PANDA.pose(q)[:3, 3] - here[:3, 3]) for q in ways.motion[::10]]
    assert max(off) < 2.5e-3 and np.abs(ways.motion[-1] - LEFT).max() > 0.45


def test_ways_on_the_spot_are_found_exactly_where_a_curve_of_the_self_motion_joins_both_postures():
    random, seen = np.random.default_rng(5), set()
    for _ in range(2):
        here = random.uniform(PANDA.limits.q_min + 0.2, PANDA.limits.q_max - 0.2)
        pose, planner = PANDA.pose(here), ftqp.Planner(PANDA, DT)
        planner.reset(here)
        curves = [curve.q for curve in ftqp.analysis.self_motion(PANDA, pose)]
        for posture in ftqp.postures(PANDA, pose, near=here, count=6):
            if np.abs(posture.q - here).max() < 0.2:
                continue
            joins = [
                all((np.abs(q - end).max(axis=1) < 0.06).any() for end in (here, posture.q)) for q in curves
            ]
            ways = Ways(planner, here, goals=[posture.q], tube=pose[None], most=20_000)
            while ways.is_searching:
                ways.search_step(500)
            assert ways.has_way == any(joins)
            seen.add(any(joins))
    assert seen == {True, False}


def test_no_looks_and_no_joints_are_no_error():
    planner, _ = walled()
    ways = Ways(planner, LEFT, goals=[RIGHT])
    assert ways.search_step(0) is WayStage.GROWING and int(ways.W.places) == 0
    for joint in PANDA.joints:
        planner.report(ftqp.Locked(joint, mode="instant"))
    goto = ftqp.GoTo(planner, q=RIGHT)
    steps = go(goto, LEFT)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE and np.array_equal(steps[-1].q, LEFT)


def test_distances_of_bodies_with_corners_are_those_of_their_hulls_by_coal():
    coal = pytest.importorskip("coal")
    random = np.random.default_rng(3)
    corners = random.normal(size=(2, 12, 3)) * [0.03, 0.05, 0.08]
    bodies = [
        ftqp.Capsule(
            (0, 0, -0.2), (0, 0, 0.2), 0.25, frame=f"panda_joint{k}", name=f"body {k}", corners=points
        )
        for k, points in zip((4, 7), corners, strict=True)
    ]
    scene = ftqp.Scene()
    scene.add("box", ftqp.Box((0.2, 0.3, 0.4), (0.4, 0.2, 0.3), rpy=(0.3, 0.2, 0.1)))
    scene.add("cylinder", ftqp.Cylinder(0.1, 0.4, (-0.4, 0.3, 0.5), rpy=(0.5, 0.1, 0.0)))
    robot = PANDA.with_capsules(bodies)
    planner = ftqp.Planner(robot, DT, scene=scene, clearance=ftqp.Clearance(self_pairs=False))
    shapes = {"box": coal.Box(0.2, 0.3, 0.4), "cylinder": coal.Cylinder(0.1, 0.4)}
    hulls = {}
    for body in bodies:
        points = coal.StdVec_Vec3s()
        for point in body.corners:
            points.append(point)
        hulls[body.label] = coal.Convex.convexHull(points, True, "Qt"), body.frame
    for q in random.uniform(PANDA.limits.q_min, PANDA.limits.q_max, (20, 7)):
        for (one, other), d in planner.distances(q).items():
            hull, frame = hulls[one]
            at = [robot.pose(q, frame), scene[other].place]
            result = coal.DistanceResult()
            places = [coal.Transform3s(T[:3, :3], T[:3, 3]) for T in at]
            away = coal.distance(hull, places[0], shapes[other], places[1], coal.DistanceRequest(), result)
            if away > 1e-6:
                assert d == pytest.approx(away, abs=1e-5)


def test_corners_outside_of_their_capsule_are_refused():
    with pytest.raises(ftqp.InputError, match="corner 1 sticks 100 mm out"):
        ftqp.Capsule((0, 0, 0), (0, 0, 0.1), 0.1, corners=[(0, 0, 0), (0.2, 0, 0)])
