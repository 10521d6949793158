"""Scenes: what can be put into one, and what is said of what cannot."""

import gc

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError


def test_a_scene_is_a_mapping_of_what_stands_there():
    scene = ftqp.Scene()
    scene.add("table", ftqp.Box((1.0, 0.6, 0.04), (0.5, 0.0, 0.3)))
    scene.add("post", ftqp.Cylinder(0.05, 1.2, (0.0, 0.8, 0.6)))
    assert list(scene) == ["table", "post"] and "table" in scene and len(scene) == 2
    np.testing.assert_array_equal(scene["table"].place[:3, 3], [0.5, 0.0, 0.3])
    turned = np.eye(4)
    turned[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    scene.move("table", turned, (0.1, 0.0, 0.0, 0.0, 0.0, 0.2))
    scene.move("table", (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(scene["table"].place[:3, :3], turned[:3, :3])
    assert not scene["table"].twist.any()
    scene.remove("table")
    assert "table" not in scene and repr(scene) == "Scene(post)"


def test_watchers_are_told_and_forgotten_with_their_planners():
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.1, (2.0, 0.0, 0.0)))
    planners = [ftqp.Planner(ftqp.robots.load("panda"), scene=scene) for _ in range(2)]
    scene.move("ball", (1.5, 0.0, 0.0))
    for planner in planners:
        assert planner._session.K.scene.place[0, 0] == 1.5
    del planners, planner
    gc.collect()
    scene.move("ball", (1.0, 0.0, 0.0))
    assert not scene._watchers


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: ftqp.Box((0.1, 0.2), (0, 0, 0)), r"size has shape \(2,\), expected \(3,\)"),
        (lambda: ftqp.Box((0.1, 0.2, 0.0)), "size is 0"),
        (lambda: ftqp.Box((400.0, 200.0, 10.0)), "are these millimetres"),
        (lambda: ftqp.Sphere(-0.1), "radius is -0.1"),
        (lambda: ftqp.Sphere(0.1, (0.0, np.nan, 0.0)), "place"),
        (lambda: ftqp.Sphere(0.1, np.diag([1.0, 2.0, 1.0, 1.0])), "not a rotation"),
        (lambda: ftqp.Cylinder(0.1, np.inf), "length"),
        (lambda: ftqp.HalfSpace((0, 0, 0), (0, 0, 0)), "expected a direction"),
        (lambda: ftqp.Capsule((0, 0, 0), (0, 0, 500.0), 0.1), "are these millimetres"),
        (lambda: ftqp.Capsule((0, 0, 0), (0, 0, 1.0), 0.1, frame=3), "frame is 3"),
        (lambda: ftqp.Clearance(keep=0.01, stop=0.02), "expected stop < keep"),
        (lambda: ftqp.Clearance(keep=-1.0), "keep"),
        (lambda: ftqp.Clearance(share=1.5), "share"),
        (lambda: ftqp.Clearance(ignore=["hand"]), "expected pairs of names"),
        (lambda: ftqp.Clearance(ignore=[("a", "b", "c")]), "expected pairs of names"),
        (lambda: ftqp.Scene().add("", ftqp.Sphere(0.1)), "expected a word"),
        (lambda: ftqp.Scene().add("ball", "sphere"), "expected a shape such as"),
        (lambda: ftqp.Scene().remove("ball"), "there is no 'ball' in the scene"),
        (lambda: ftqp.Scene().move("ball", (0, 0, 0)), "there is no 'ball' in the scene"),
    ],
)
def test_what_is_no_scene_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


def test_a_move_that_is_refused_leaves_the_thing_where_it_was():
    scene = ftqp.Scene()
    scene.add("ball", ftqp.Sphere(0.1, (1.0, 0.0, 0.0)))
    for place, twist in (((np.nan, 0, 0), None), ((0, 0, 0), (1.0, 2.0)), (np.zeros((3, 3)), None)):
        with pytest.raises(InputError):
            scene.move("ball", place, twist)
    with pytest.raises(InputError, match="there is a 'ball' in the scene"):
        scene.add("ball", ftqp.Sphere(0.1))
    np.testing.assert_array_equal(scene["ball"].place[:3, 3], [1.0, 0.0, 0.0])


def test_a_full_scene_says_so():
    scene = ftqp.Scene()
    for k in range(64):
        scene.add(f"{k}", ftqp.Sphere(0.01, (3.0, 0.0, 0.1 * k)))
    with pytest.raises(InputError, match="no room for 'one more'"):
        scene.add("one more", ftqp.Sphere(0.01))
