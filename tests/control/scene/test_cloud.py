"""A cloud of balls: what of it each body keeps clear of, against all balls at once."""

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
KEEP = 0.02


def cloud(rng, count=1000, radius=0.02):
    """Balls all over the room but where the arm begins."""
    balls = np.column_stack(
        [rng.uniform((-0.9, -0.9, 0.0), (0.9, 0.9, 1.2), (4 * count, 3)), np.full(4 * count, radius)]
    )
    return balls[truth(PANDA.neutral, balls).min(axis=0) > 0.06][:count]


def truth(q, balls):
    """The distance of every capsule that moves from every ball, (C, K) [m]."""
    found = []
    for one in PANDA.capsules:
        if one.frame == "universe":
            continue
        T = PANDA.pose(q, one.frame)
        a, b = (T[:3, :3] @ end + T[:3, 3] for end in (one.a, one.b))
        way = b - a
        s = np.clip((balls[:, :3] - a) @ way / max(way @ way, 1e-12), 0.0, 1.0)
        found.append(np.linalg.norm(a + s[:, None] * way - balls[:, :3], axis=1) - one.radius - balls[:, 3])
    return np.array(found)


def test_the_nearest_ball_of_each_body_is_found_at_any_posture():
    rng = np.random.default_rng(3)
    scene = ftqp.Scene()
    balls = cloud(rng)
    scene.update(balls)
    planner = ftqp.Planner(PANDA, scene=scene, clearance=ftqp.Clearance(keep=KEEP, self_pairs=False))
    labels = [one.label for one in PANDA.capsules if one.frame != "universe"]
    for _ in range(20):
        q = rng.uniform(PANDA.limits.q_min, PANDA.limits.q_max)
        seen, true = planner.distances(q), truth(q, balls).min(axis=1)
        for label, d in zip(labels, true, strict=True):
            if (label, "cloud") in seen:  # one that turns about its own axis stays where it is
                assert seen[label, "cloud"] == pytest.approx(d, abs=1e-12)
    assert len(seen) >= 7


def test_an_arm_among_a_thousand_balls_keeps_clear_of_all_although_a_joint_locks():
    hit, kept = 0, []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        balls = cloud(rng)
        scene = ftqp.Scene()
        way = rng.normal(size=3)
        line = ftqp.paths.Line(
            PANDA.pose(PANDA.neutral), tuple(0.3 * way / np.linalg.norm(way)), duration=2.0
        )
        for seeing in (False, True):
            planner = ftqp.Planner(
                PANDA, 2e-3, scene=scene if seeing else None, emergency=None,
                clearance=ftqp.Clearance(keep=KEEP, stop=0.001) if seeing else None,
            )  # fmt: skip
            if seeing:
                scene.update(balls)
            planner.reset(PANDA.neutral)
            q, v, least = PANDA.neutral.copy(), np.zeros(7), np.inf
            for k in range(1250):
                if k == 300:
                    planner.report(ftqp.Locked(int(rng.integers(7))))
                if seeing and k % 50 == 0:
                    scene.update(balls[rng.permutation(len(balls))])  # as the next picture has them
                at = line.sample(np.array([min(k * 2e-3, 2.0)]))
                target = ftqp.Target(pose=at.pose[0], twist=at.twist[0], acceleration=at.acceleration[0])
                step = planner.step(q, v, target)
                q, v = step.q.copy(), step.v.copy()
                if k % 10 == 0:
                    least = min(least, truth(q, balls).min())
            if seeing:
                kept.append(least)
            else:
                hit += least < 0.0
    assert hit >= 2
    assert min(kept) > KEEP - 5e-3, kept


def test_a_cloud_comes_goes_and_changes_with_every_picture():
    scene = ftqp.Scene()
    planner = ftqp.Planner(PANDA, scene=scene, clearance=ftqp.Clearance(self_pairs=False))
    planner.reset(PANDA.neutral)
    target = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
    assert planner.step(PANDA.neutral, None, target).clearance == np.inf
    tip = PANDA.pose(PANDA.neutral)[:3, 3]
    scene.update([[*(tip + np.array((0.3, 0.0, 0.0))), 0.01]])
    step = planner.step(PANDA.neutral, None, target)
    near = step.clearance
    assert near < 0.3 and step.nearest[1] == "cloud"
    scene.update(np.zeros((0, 4)))
    assert planner.step(PANDA.neutral, None, target).clearance > 1e3
    scene.update([[*(tip + np.array((0.2, 0.0, 0.0))), 0.02]])
    assert planner.step(PANDA.neutral, None, target).clearance < near
    scene.add("box", ftqp.Box((0.1, 0.1, 0.1), (5.0, 0.0, 0.0)))
    assert planner.step(PANDA.neutral, None, target).nearest[1] == "cloud"


@pytest.mark.parametrize(
    ("balls", "said"),
    [
        (np.zeros((3, 3)), r"shape \(3, 3\), expected \(K, 4\)"),
        (np.full((2, 4), np.nan), "contains NaN"),
        (np.ones((5000, 4)), "balls are 5000, expected at most 4096"),
        (np.array([[0.0, 0.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.0]]), "ball 1 has the radius 0"),
        ("balls", "balls"),
    ],
)
def test_what_is_no_cloud_is_refused_and_changes_nothing(balls, said):
    scene = ftqp.Scene()
    scene.update([[1.0, 0.0, 0.0, 0.1]])
    with pytest.raises(InputError, match=said):
        scene.update(balls)
    assert scene.balls.tolist() == [[1.0, 0.0, 0.0, 0.1]]
    with pytest.raises(InputError, match="give this another name"):
        scene.add("cloud", ftqp.Sphere(0.1))
