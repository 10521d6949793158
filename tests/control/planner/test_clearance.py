"""Arms that keep clear of a scene and of themselves: rows, what they hold, and what is said of them."""

import coal
import numpy as np
import pytest
from tests.going import closed_loop, started

import ftqp
from ftqp.control.planner.planner_view import row_labels
from ftqp.core.errors import InputError
from ftqp.kernel.layout.rows import CLEARANCES

DT, KEEP = 1e-3, 0.02
PANDA = ftqp.robots.load("panda")
START = PANDA.neutral
TIP = PANDA.pose(START)


def scene(**shapes):
    found = ftqp.Scene()
    for name, shape in shapes.items():
        found.add(name, shape)
    return found


def follow(planner, goal, ticks=1500, rise=600, at=None, told=None):
    """Lead the tip to a place within ``rise`` ticks, and stay; the last step and the least clearance."""
    least, target = np.inf, TIP.copy()

    def there(k):
        target[:3, 3] = TIP[:3, 3] + (np.asarray(goal) - TIP[:3, 3]) * min(k / rise, 1.0)
        return ftqp.Target(pose=target)

    for step in closed_loop(planner, there, ticks, START, events={at: lambda _: told()}):
        least = min(least, step.clearance)
    return step, least


BALL = ftqp.Sphere(0.05, (0.55, 0.3, 0.45))
THINGS = {
    "ball": (BALL, (0.55, 0.3, 0.45)),
    "wall": (ftqp.Box((0.1, 1.0, 1.0), (0.6, 0.0, 0.5)), (0.7, 0.0, 0.5)),
    "can": (ftqp.Cylinder(0.08, 0.5, (0.6, 0.1, 0.4)), (0.7, 0.1, 0.5)),
    "rod": (ftqp.Capsule((0.55, -0.5, 0.4), (0.55, 0.5, 0.4), 0.03), (0.62, 0.1, 0.35)),
    "wedge": (
        ftqp.Hull(
            [(0, -0.4, 0), (0, 0.4, 0), (0.3, -0.4, 0.3), (0.3, 0.4, 0.3), (0.3, 0, -0.3)],
            place=(0.57, 0.05, 0.4),
        ),
        (0.75, 0.1, 0.45),
    ),
    "ceiling": (ftqp.HalfSpace((0.0, 0.0, 0.9), (0.0, 0.0, -1.0)), (0.3, 0.0, 1.1)),
}


@pytest.mark.parametrize("name", THINGS)
def test_an_arm_that_is_led_into_something_stays_clear_of_it_and_says_why(name, level):
    shape, goal = THINGS[name]
    planner = ftqp.Planner(PANDA, DT, level=level, emergency=None, scene=scene(**{name: shape}))
    step, least = follow(planner, goal)
    assert least > KEEP - 5e-5
    assert step.status is ftqp.StepStatus.RELAXED
    assert name in str(step.certificate) or "panda" in str(step.certificate)
    held = [said for said in step.limits_active if said.endswith("their clearance")]
    assert held and step.position_error > 0.02
    per = planner.distances(step.q)
    assert min(per.values()) > KEEP - 1e-3


@pytest.mark.parametrize("name", ["ball", "wall", "can", "wedge"])
def test_an_arm_beside_something_rests_without_vibration(name):
    shape, goal = THINGS[name]
    planner = ftqp.Planner(PANDA, DT, emergency=None, scene=scene(**{name: shape}))
    step, _ = follow(planner, goal, ticks=2000)
    target = TIP.copy()
    target[:3, 3] = goal
    steps = closed_loop(planner, ftqp.Target(pose=target), 1000, step.q, step.v, reset=False)
    signs = [np.where(np.abs(step.a) > 1e-3, np.sign(step.a), 0.0) for step in steps]
    changes = (np.diff(np.array(signs), axis=0) != 0.0).sum(axis=0)
    assert changes.max() <= 12


@pytest.mark.parametrize("backend", ["daqp", "proxqp", "osqp", "quadprog", "dtrnn"])
def test_every_backend_keeps_clear(backend):
    planner = ftqp.Planner(PANDA, DT, emergency=None, backend=backend, scene=scene(ball=BALL))
    assert follow(planner, (0.55, 0.3, 0.45), ticks=900)[1] > KEEP - 1e-4
    assert row_labels(planner)[-CLEARANCES:] == tuple(f"clearance pair {k + 1}" for k in range(CLEARANCES))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("joint", [3, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 1, 2, 4, 5, 6))])
def test_an_arm_that_fails_on_its_way_past_balls_does_not_hit_them(joint, seed):
    rng = np.random.default_rng(10 * joint + seed)
    around = scene()
    while len(around) < 10:
        place = TIP[:3, 3] + rng.normal(size=3) * 0.25
        around.add(f"ball {len(around)}", ftqp.Sphere(0.05, place))
        if min(ftqp.Planner(PANDA, DT, scene=around).distances(START).values()) < KEEP + 0.005:
            around.remove(f"ball {len(around) - 1}")
    planner = ftqp.Planner(PANDA, DT, emergency=None, scene=around)
    goal = TIP[:3, 3] + rng.normal(size=3) * 0.2
    _, least = follow(planner, goal, at=300, told=lambda: planner.report(ftqp.Locked(joint)))
    assert least > KEEP - 1e-3


def test_an_arm_that_begins_inside_something_is_led_out():
    inside = ftqp.Sphere(0.05, TIP[:3, 3] + [0.0, 0.0, 0.05])
    planner = started(PANDA, DT, emergency=None, scene=scene(ball=inside), at=START)
    step = planner.step(START, None, ftqp.Target(pose=TIP))
    assert step.clearance < -0.05 and "into each other" in str(step.certificate)
    step, _ = follow(planner, TIP[:3, 3], ticks=2500)
    assert step.clearance > KEEP - 1e-3


def test_an_obstacle_that_comes_is_fled_from_and_one_that_leaves_is_forgotten():
    begin = TIP[:3, 3] + [0.5, 0.0, 0.0]
    around = scene(ball=ftqp.Sphere(0.05, begin))
    planner, target = ftqp.Planner(PANDA, DT, emergency=None, scene=around), ftqp.Target(pose=TIP)
    for k, step in enumerate(closed_loop(planner, target, 2500)):
        assert step.clearance > KEEP - 1e-3
        if k % 20 == 0:  # seen at 50 Hz, and moved on by its velocity between
            around.move("ball", begin - [0.2 * k * DT, 0.0, 0.0], (-0.2, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert step.position_error > 1e-3
    around.remove("ball")
    *_, step = closed_loop(planner, target, 2500, step.q, step.v, reset=False)
    assert step.status is ftqp.StepStatus.OK and "ball" not in (step.nearest or ())


def test_below_the_stop_distance_an_arm_that_still_comes_nearer_is_stopped():
    planner = ftqp.Planner(PANDA, DT, emergency=None, scene=(around := scene(ball=BALL)))
    falling = TIP[:3, 3] + [0.0, 0.0, 0.12], (0.0, 0.0, -3.0, 0.0, 0.0, 0.0)
    comes = {100: lambda planner: around.move("ball", *falling)}  # to where the hand is in a moment
    *_, step = closed_loop(planner, ftqp.Target(pose=TIP), 400, events=comes)
    assert step.status in (ftqp.StepStatus.STOPPED, ftqp.StepStatus.STOPPING)
    assert " and ".join(step.nearest) + " were nearer than Clearance(stop=...)" in planner.stopped_because


def beside(y):
    target = TIP.copy()
    target[1, 3] += y
    return ftqp.Target(pose=target)


def test_without_a_scene_nothing_is_kept_and_nothing_moves_otherwise():
    runs = []
    for more in ({}, {"scene": scene(far=ftqp.Sphere(0.1, (5.0, 5.0, 5.0)))}):
        planner = ftqp.Planner(PANDA, DT, clearance=ftqp.Clearance() if more else None, **more)
        steps = closed_loop(planner, lambda k: beside(0.05 * np.sin(0.01 * k)), 300, START)
        runs.append(np.array([step.q.copy() for step in steps]))
    np.testing.assert_array_equal(*runs)
    bare = started(PANDA, DT, at=START)
    step = bare.step(START, None, ftqp.Target(pose=TIP))
    assert step.clearance == np.inf and step.nearest is None and bare.scene is None
    with pytest.raises(InputError, match="keeps clear of nothing"):
        bare.distances(START)


@pytest.mark.slow
def test_more_pairs_than_there_is_room_for_are_refused_and_the_scene_stays_as_it_was():
    planner = ftqp.Planner(PANDA, DT, scene=(around := ftqp.Scene()))
    with pytest.raises(InputError, match="pairs of bodies would be watched"):
        for k in range(64):
            around.add(f"box {k}", ftqp.Box((0.1, 0.1, 0.1), (2.0, 0.1 * k, 0.0)))
    there = len(around)
    assert 20 < there < 64 and len(planner.distances(START)) > 20
    around.remove("box 0")
    around.add("again", ftqp.Sphere(0.1, (2.0, 0.0, 0.0)))
    assert len(around) == there


def test_the_pairs_are_told_and_left_out_by_name():
    planner = ftqp.Planner(PANDA, DT, scene=scene(floor=ftqp.HalfSpace((0.0, 0.0, -0.02))))
    per = planner.distances(START)
    assert ("panda_hand", "floor") in per
    assert ("panda_link5", "panda_link3") in per and ("panda_link4", "panda_link3") not in per
    fewer = ftqp.Clearance(ignore=[("panda_hand", "floor")])
    planner = ftqp.Planner(PANDA, DT, scene=planner.scene, clearance=fewer)
    assert ("panda_hand", "floor") not in planner.distances(START)
    alone = ftqp.Clearance(self_pairs=False)
    assert not ftqp.Planner(PANDA, DT, clearance=alone).distances(START)


def test_an_arm_that_touches_itself_where_it_begins_is_refused_by_name():
    at = PANDA.pose(START, "panda_joint1")
    hand = at[:3, :3].T @ (PANDA.pose(START, "panda_joint7")[:3, 3] - at[:3, 3])
    post = ftqp.Capsule(hand, hand, 0.05, frame="panda_joint1", name="post")
    robot = PANDA.with_capsules([post, ftqp.Capsule((0, 0, 0), (0, 0, 0.1), 0.05, frame="panda_joint7")])
    with pytest.raises(InputError, match=r"panda_joint7 and post of panda touch .*ignore="):
        ftqp.Planner(robot, DT, clearance=ftqp.Clearance())
    ignore = ftqp.Clearance(ignore=[("post", "panda_joint7")])
    assert not ftqp.Planner(robot, DT, clearance=ignore).distances(START)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"scene": [1]}, r"scene\.add\(name, shape\), or None"),
        ({"clearance": 0.02}, r"ftqp\.Clearance\(keep=0\.02\) or None"),
        ({"clearance": ftqp.Clearance(ignore=[("panda_hand", "tabel")])}, "names of capsules"),
        ({"clearance": ftqp.Clearance(), "scheme": "pseudoinverse", "level": "velocity"}, "solves no QP"),
    ],
)
def test_what_cannot_be_kept_is_refused(more, said):
    with pytest.raises(InputError, match=said):
        ftqp.Planner(PANDA, DT, **more)


def test_what_is_attached_is_kept_clear_until_it_is_detached():
    wall = scene(wall=ftqp.Box((0.1, 1.0, 1.0), (0.75, 0.0, 0.5)))
    reach = {}
    for rod in (False, True):
        planner = ftqp.Planner(PANDA, DT, emergency=None, scene=wall)
        if rod:
            planner.attach("rod", ftqp.Capsule((0, 0, 0), (0.15, 0, 0), 0.01))
            assert ("rod", "wall") in planner.distances(START)
        step, least = follow(planner, (0.8, 0.0, 0.5), ticks=1200)
        assert least > KEEP - 1e-3
        reach[rod] = PANDA.pose(step.q)[0, 3]
        if rod:
            assert "rod" in str(step.certificate)
            planner.detach("rod")
            assert ("rod", "wall") not in planner.distances(START)
    assert reach[True] < reach[False] - 0.02
    kept = planner.distances(START)
    elbow = TIP[:3, :3].T @ (PANDA.pose(START, "panda_joint4")[:3, 3] - TIP[:3, 3])
    for name, shapes, said in (
        ("", ftqp.Capsule((0, 0, 0), (0, 0, 0.1), 0.01), "expected a word"),
        ("wall", ftqp.Capsule((0, 0, 0), (0, 0, 0.1), 0.01), "there is a 'wall' already"),
        ("ball", BALL, "expected a list of ftqp.Capsule"),
        ("rod", [], "expected a list of ftqp.Capsule"),
        ("rod", ftqp.Capsule((0, 0, 0), (0, 0, 0.1), 0.01, frame="elbow"), "frame is 'elbow'"),
        ("rod", ftqp.Capsule(elbow, elbow, 0.02), "touch at its neutral posture"),
    ):
        with pytest.raises(InputError, match=said):
            planner.attach(name, shapes)
    assert planner.distances(START).keys() == kept.keys()
    with pytest.raises(InputError, match="there is no 'rod' attached"):
        planner.detach("rod")
    with pytest.raises(InputError, match="keeps clear of nothing"):
        ftqp.Planner(PANDA, DT).attach("rod", ftqp.Capsule((0, 0, 0), (0, 0, 0.1), 0.01))


def test_above_a_base_that_moves_a_scene_is_refused():
    planner = ftqp.Planner(PANDA, 5e-3, level="velocity", scene=scene(ball=BALL))
    with pytest.raises(InputError, match="a scene stands where the base does"):
        ftqp.InertialTask(planner)


def test_the_kernel_measures_what_coal_measures_between_links():
    planner = ftqp.Planner(PANDA, DT, clearance=ftqp.Clearance())
    rng = np.random.default_rng(0)
    bodies = {capsule.label: capsule for capsule in PANDA.capsules}
    for _ in range(20):
        q = rng.uniform(PANDA.limits.q_min, PANDA.limits.q_max)
        for names, d in planner.distances(q).items():
            made = []
            for name in names:
                one = bodies[name]
                T = PANDA.pose(q, one.frame) @ one.place
                made += [coal.Capsule(one.radius, 2.0 * one.extent[0]), coal.Transform3s(T[:3, :3], T[:3, 3])]
            far = coal.distance(*made, coal.DistanceRequest(), coal.DistanceResult())
            assert d == pytest.approx(far, abs=1e-13)


def test_the_solver_never_fails_beside_bodies_that_cannot_be_parted():
    shell = scene(**{f"{k}": ftqp.Sphere(0.2, TIP[:3, 3] + 0.22 * d) for k, d in enumerate(_ways())})
    planner = ftqp.Planner(PANDA, DT, emergency=None, scene=shell)
    for step in closed_loop(planner, ftqp.Target(pose=TIP), 400, START):
        assert np.isfinite(step.a).all() and (np.abs(step.a) <= PANDA.limits.a_max + 1e-9).all()
        assert step.status in (ftqp.StepStatus.RELAXED, ftqp.StepStatus.STOPPING, ftqp.StepStatus.STOPPED)


def _ways():
    return [sign * np.eye(3)[k] for k in range(3) for sign in (1.0, -1.0)]
