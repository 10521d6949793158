"""Changes of a scene that an exception ends, or that a planner refuses: all is as before, or all as after."""

import numpy as np
import pytest
from tests.interrupted import interrupted, lines_of

import ftqp
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
HERE = ftqp.Target(pose=PANDA.pose(PANDA.neutral))
WALL = ftqp.Box((0.1, 1.0, 1.0), (0.9, 0.0, 0.5))
POST = ftqp.Cylinder(0.03, 1.0, (0.2, 0.6, 0.5))
TRAY = [ftqp.Capsule((0, -0.1, 0.05), (0, 0.1, 0.05), 0.02)]
BALLS = np.array([[0.7, 0.4, 0.5, 0.05], [0.7, -0.4, 0.5, 0.05], [0.4, 0.5, 0.7, 0.03]])
CHANGES = {
    "add": (lambda s, p: s.add("post", POST), lambda s, p: s.remove("post")),
    "remove": (lambda s, p: s.remove("wall"), lambda s, p: s.add("wall", WALL)),
    "move": (
        lambda s, p: s.move("wall", (1.0, 0.1, 0.5), (0.1, 0, 0, 0, 0, 0)),
        lambda s, p: s.move("wall", (0.9, 0.0, 0.5)),
    ),
    "first balls": (lambda s, p: s.update(BALLS), lambda s, p: s.update(np.zeros((0, 4)))),
    "next balls": (lambda s, p: s.update(BALLS + np.array([0.1, 0, 0, 0])), lambda s, p: s.update(BALLS)),
    "no balls": (lambda s, p: s.update(np.zeros((0, 4))), lambda s, p: s.update(BALLS)),
    "attach": (lambda s, p: p.attach("tray", TRAY), lambda s, p: p.detach("tray")),
    "detach": (lambda s, p: p.detach("tray"), lambda s, p: p.attach("tray", TRAY)),
}


def watched(planner):
    """What a planner keeps its arm away from here, and how far it is."""
    found = planner.distances(PANDA.neutral)
    return {names: d for names, d in found.items() if d < 1e3}  # a ball that is not there is far away


def stepped(planner):
    """What a step knows of it, from a reset."""
    planner.reset(PANDA.neutral)
    return planner.step(PANDA.neutral, None, HERE)


def known(scene, planners):
    """All that is known after a change: by the scene, by each planner, and by a step of each."""
    return (
        set(scene), len(scene.balls), [watched(one) for one in planners],
        [(stepped(one).clearance, one.stopped_because) for one in planners],
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("share", [7, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=[pytest.mark.slow] if one in ("add", "detach") else []) for one in CHANGES],
)
def test_a_change_that_is_interrupted_at_any_line_is_whole_or_was_none(name, share):
    change, back = CHANGES[name]
    scene = ftqp.Scene()
    scene.add("wall", WALL)
    planners = [
        ftqp.Planner(PANDA, scene=scene, clearance=ftqp.Clearance(keep=keep)) for keep in (0.02, 0.01)
    ]
    if name in ("next balls", "no balls"):
        scene.update(BALLS)
    if name == "detach":
        planners[0].attach("tray", TRAY)
    back_and_forth = lambda: (change(scene, planners[0]), back(scene, planners[0]))  # noqa: E731
    back_and_forth()
    before = known(scene, planners)
    change(scene, planners[0])
    after = known(scene, planners)
    assert before != after
    back(scene, planners[0])
    lines, met = lines_of(lambda: change(scene, planners[0])), [0, 0]
    back(scene, planners[0])
    for line in lines[::share]:
        interrupted(lambda: change(scene, planners[0]), line)
        now = known(scene, planners)
        assert now in (before, after), line
        met[now == after] += 1
        if now == after:
            back(scene, planners[0])
    assert met[0] > 20 // share and len(lines) > 40


def test_what_a_planner_refuses_changes_neither_the_scene_nor_any_planner():
    scene = ftqp.Scene()
    scene.add("wall", WALL)
    patient = ftqp.Planner(PANDA, scene=scene)
    many = PANDA.with_capsules(
        [ftqp.Capsule((0, 0, 0.01 * k), (0, 0, 0.02 + 0.01 * k), 0.01, frame="panda_joint4", name=f"{k}")
         for k in range(25)]
    )  # fmt: skip
    crowded = ftqp.Planner(
        many, scene=scene, clearance=ftqp.Clearance(self_pairs=False, ignore=[("0", "wall")])
    )
    before = known(scene, [patient, crowded])
    with pytest.raises(InputError, match="would keep clear of a cloud"):
        scene.update(BALLS)
    assert known(scene, [patient, crowded]) == before
    with pytest.raises(InputError, match="ignore has 'wall'"):
        scene.remove("wall")
    assert known(scene, [patient, crowded]) == before
    with pytest.raises(InputError, match="two things are called '3'"):
        scene.add("3", POST)
    assert known(scene, [patient, crowded]) == before
    scene.add("post", POST)
    assert ("7", "post") in watched(crowded) and any("post" in pair for pair in watched(patient))


def test_too_many_bodies_at_the_tip_leave_what_is_watched():
    scene = ftqp.Scene()
    scene.add("wall", WALL)
    planner = ftqp.Planner(PANDA, scene=scene)
    before = known(scene, [planner])
    with pytest.raises(InputError, match="expected at most 128"):
        planner.attach("grid", [ftqp.Capsule((0, 0, 0), (0, 0, 0.001 * k), 0.01) for k in range(1, 60)])
    assert known(scene, [planner]) == before


def test_a_scene_that_no_body_is_watched_against_is_refused():
    blind = ftqp.Clearance(
        self_pairs=False, ignore=[(one.label, name) for one in PANDA.capsules for name in ("wall", "cloud")]
    )
    scene = ftqp.Scene()
    scene.add("wall", WALL)
    with pytest.raises(InputError, match="no body of panda would be watched against what stands"):
        ftqp.Planner(PANDA, scene=scene, clearance=blind)
    scene.add("post", POST)
    planner = ftqp.Planner(PANDA, scene=scene, clearance=blind)
    before = known(scene, [planner])
    with pytest.raises(InputError, match=r"take names out of Clearance\(ignore"):
        scene.remove("post")
    assert known(scene, [planner]) == before


def test_what_moves_on_by_itself_is_not_put_back_where_something_else_comes():
    scene = ftqp.Scene()
    scene.add("car", ftqp.Sphere(0.05, (2.0, 0.0, 0.5)))
    planner = ftqp.Planner(PANDA, scene=scene)
    scene.move("car", (2.0, 0.0, 0.5), (-1.0, 0, 0, 0, 0, 0))
    planner.reset(PANDA.neutral)
    for _ in range(500):
        planner.step(PANDA.neutral, None, HERE)
    came = min(d for names, d in watched(planner).items() if "car" in names)
    scene.add("post", POST)
    assert min(d for names, d in watched(planner).items() if "car" in names) == came
