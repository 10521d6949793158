"""Planted touches and further tasks that are missed are found from joints alone."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.checker.test_run_laws import ARM, DT, JOINT, ROBOT, run

import ftqp
from ftqp.checker.checked_run import verdict
from ftqp.checker.claim_laws import task_errors
from ftqp.checker.trace import PHYSICS, Body, Cone, Failure, HeldTask, Thing

KEEP = 0.03
KINDS = {
    "sphere": (0.0, 0.05, 0.0),
    "capsule": (0.2, 0.05, 0.0),
    "box": (0.1, 0.2, 0.05),
    "cylinder": (0.2, 0.05, 0.0),
    "half_space": (0.0, 0.0, 0.0),
    "hull": (0.3, 0.1, 0.2),
}
CORNERS = np.array([[0.3, 0.0, 0.0], [-0.3, 0.1, 0.0], [-0.3, -0.1, 0.0], [0.0, 0.0, 0.2], [0.0, 0.05, -0.2]])


def link(name="link", joint=JOINT, size=0.04):
    at = ROBOT.pose(np.zeros(ROBOT.nv), ROBOT.joints[joint])
    ends = [at[:3, 3].tolist(), (at[:3, 3] + 0.1 * at[:3, 2]).tolist()]
    return Body(name=name, joint=joint, ends_at_zero=ends, radius=size)


def beside(kind, room):
    """Something ahead of the link, from which it is ``room`` away at the nearest in the sound run."""
    planner = ftqp.Planner(
        ROBOT.with_capsules([_capsule()]),
        scene=(scene := ftqp.Scene()),
        clearance=ftqp.Clearance(self_pairs=False),
    )
    scene.add("thing", _shape(kind))
    low, high = -1.0, 3.0
    for _ in range(60):  # how far ahead it stands
        middle = 0.5 * (low + high)
        scene.move("thing", _place(middle))
        ((_, d),) = planner.distances(run().q).items()
        low, high = (low, middle) if d.min() > room else (middle, high)
    assert d[0] > room + 0.002
    return Thing(name="thing", kind=kind, extent=KINDS[kind], pose=_place(high), corners=CORNERS)


def _capsule():
    T = ROBOT.pose(np.zeros(ROBOT.nv), ROBOT.joints[JOINT])
    a, b = (T[:3, :3].T @ (np.array(end) - T[:3, 3]) for end in link().ends_at_zero)
    return ftqp.Capsule(a, b, 0.04, frame=ROBOT.joints[JOINT], name="link")


def _shape(kind):
    x, y, z = KINDS[kind]
    match kind:
        case "sphere":
            return ftqp.Sphere(y)
        case "capsule":
            return ftqp.Capsule((0, 0, -x), (0, 0, x), y)
        case "box":
            return ftqp.Box((2 * x, 2 * y, 2 * z))
        case "cylinder":
            return ftqp.Cylinder(y, 2 * x)
        case "hull":
            return ftqp.Hull(CORNERS)
        case _:
            return ftqp.HalfSpace()


def _place(ahead):
    """So far ahead of where the link gets at most, along its way, with the z axis against that."""
    q = run().q
    far = int(np.argmax(np.abs(q - q[0]).max(axis=1)))
    begin, end = (ROBOT.pose(q[k], ROBOT.joints[JOINT])[:3, 3] for k in (0, far))
    way = (end - begin) / np.linalg.norm(end - begin)
    x = np.cross(way, [0.0, 0.0, 1.0] if abs(way[2]) < 0.9 else [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(-way, x), -way]), end + ahead * way
    return T


def laws(bodies, things, watched, **more):
    trace = run(bodies=bodies, things=things, watched=watched, keep=KEEP, **more)
    return verdict(ARM, trace).laws


@pytest.mark.parametrize("kind", KINDS)
def test_a_link_that_keeps_clear_is_let_pass_and_one_that_comes_too_near_is_found(kind):
    assert "touched" not in laws([link()], [beside(kind, KEEP + 1e-4)], [("link", "thing")])
    near = run(bodies=[link()], things=[beside(kind, KEEP - 0.002)], watched=[("link", "thing")], keep=KEEP)
    (breach,) = verdict(ARM, near).breaches
    assert breach.law == "touched" and breach.joint == ROBOT.joints[JOINT]
    assert breach.size == pytest.approx(0.001, abs=1e-5)


def test_links_are_kept_apart_from_each_other_and_pairs_that_nobody_watches_are_not():
    other = link("other", 0, 5.0)
    assert "touched" not in laws([link(), other], [], [])
    still = run()
    inside = replace(still, bodies=[link(), other], watched=[("link", "other")], keep=KEEP)
    assert "touched" not in verdict(ARM, inside).laws  # it begins so, and does not go farther


def test_a_link_behind_a_joint_that_swings_freely_is_excused():
    thing = beside("sphere", KEEP - 0.01)
    free = Failure(joint=JOINT, kind="free", since=0.0, reported_at=0.0)
    assert "touched" not in laws([link()], [thing], [("link", "thing")], failures=[free])


def cone(room):
    """A cone that an axis behind a joint keeps an angle from in the sound run, at the nearest."""
    at_zero, axis = ROBOT.pose(np.zeros(ROBOT.nv), ROBOT.joints[JOINT]), np.array([0.6, 0.0, 0.8])
    axes = [ROBOT.pose(q, ROBOT.joints[JOINT])[:3, :3] @ axis for q in run().q]
    along = np.array([0.1, 0.2, 1.0]) / np.linalg.norm([0.1, 0.2, 1.0])
    return Cone(
        joint=JOINT, at_zero=at_zero[:3, 3].tolist(), axis_at_zero=(at_zero[:3, :3] @ axis).tolist(),
        along=along.tolist(), within=float(np.arccos(axes @ along).max()) + room,
    )  # fmt: skip


def test_axis_in_its_cone_is_let_pass_and_one_outside_is_found():
    assert verdict(ARM, run(cones=[cone(0.0), cone(0.1)])).laws == set()
    (breach,) = verdict(ARM, run(cones=[cone(0.1), cone(-0.001)])).breaches
    assert breach.law == "cone" and breach.joint == ROBOT.joints[JOINT]
    assert breach.size == pytest.approx(0.001 - 2e-5, abs=1e-6)
    assert "an axis that it moves is outside its cone" in str(breach)


def test_axis_that_begins_outside_may_stay_and_one_that_swings_freely_is_excused():
    still = run()
    still = replace(still, cones=[replace(cone(0.0), within=0.01)], q=np.tile(still.q[:1], (len(still.q), 1)))
    assert "cone" not in verdict(ARM, still).laws
    free = Failure(joint=JOINT, kind="free", since=0.0, reported_at=0.0)
    assert "cone" not in verdict(ARM, run(cones=[cone(-0.001)], failures=[free])).laws


AT_ZERO = ROBOT.pose(np.zeros(ROBOT.nv), ROBOT.joints[JOINT])
STILL = run(amplitude=0.0)


def held(away, rows=("x", "y"), **more):
    """A point behind a joint that is to be away from where the still run has it."""
    target = ROBOT.pose(STILL.q[0], ROBOT.joints[JOINT])[:3, 3] + away
    known = {"name": "elbow", "kind": "position", "rows": rows, "joint": JOINT, "at_zero": AT_ZERO}
    return HeldTask(**{**known, "target": target, **more})


def pushed(first, last, amount=0.05):
    """The still run with a joint pushed aside for some ticks."""
    q = STILL.q.copy()
    q[first:last, 0] += amount
    return replace(STILL, q=q)


def test_every_kind_is_what_pinocchio_says():
    rng, frame = np.random.default_rng(4), ROBOT.joints[JOINT]
    q = ROBOT.neutral + 0.3 * rng.normal(size=(5, ROBOT.nv))
    T = np.array([ROBOT.pose(one, frame) for one in q])
    tip_at_zero, tips = ROBOT.pose(np.zeros(ROBOT.nv)), np.array([ROBOT.pose(one) for one in q])
    goal = pin.SE3.Random().homogeneous
    axis, place = np.array([0.0, 0.6, 0.8]), np.array([0.4, 0.1, 0.3])
    turned = [pin.log3(goal[:3, :3] @ one[:3, :3].T)[[0, 2]] for one in T]
    position, rotation = task_errors(ARM, q, held(0.0, ("z", "rx", "rz"), kind="pose", target=goal))
    np.testing.assert_allclose(position, np.abs(goal[2, 3] - T[:, 2, 3]), atol=1e-12)
    np.testing.assert_allclose(rotation, np.linalg.norm(turned, axis=1), atol=1e-9)
    relative = held(0.0, ("x", "y", "z"), kind="relative", target=goal, other=6, other_at_zero=tip_at_zero)
    np.testing.assert_allclose(
        task_errors(ARM, q, relative)[0],
        np.linalg.norm((tips @ goal)[:, :3, 3] - T[:, :3, 3], axis=1), atol=1e-12,
    )  # fmt: skip
    mass = held(0.0, ("x",), kind="centre_of_mass", target=place)
    centres = [pin.centerOfMass(ROBOT.model, ROBOT.model.createData(), one)[0] for one in q]
    np.testing.assert_allclose(task_errors(ARM, q, mass)[0], np.abs(0.4 - np.array(centres)), atol=1e-12)
    for more, wished in (
        ({"target": place}, np.tile(place, (5, 1))),
        ({"target": place, "towards": True}, place - T[:, :3, 3]),
        ({"target": place, "towards": True, "other": 6, "other_at_zero": tip_at_zero}, (tips - T)[:, :3, 3]),
    ):
        cosine = np.sum(T[:, :3, :3] @ axis * wished, axis=1) / np.linalg.norm(wished, axis=1)
        none, angle = task_errors(ARM, q, held(0.0, kind="axis", axis=axis, **more))
        np.testing.assert_allclose(angle, np.arccos(cosine), atol=1e-9)
        assert not none.any()


def test_a_kept_task_is_let_pass_and_one_that_is_left_under_ok_is_found():
    kept = held([0.0, 0.009, 7.0])  # within the tolerance of the tip's task, and z does not count
    near = replace(STILL, tolerance=(0.01, 0.05), held=[kept])
    assert "tasks" not in verdict(ARM, near).laws
    left = replace(pushed(50, 60), tolerance=(0.01, 0.05), held=[kept])
    (breach,) = [one for one in verdict(ARM, left).breaches if one.law == "tasks"]
    assert (breach.tick, breach.ticks, breach.joint) == (50, 10, "") and breach.size > 0.1
    said = ["RELAXED" if 50 <= k < 60 else "OK" for k in range(len(left.status))]
    assert "tasks" not in verdict(ARM, replace(left, status=said)).laws


@pytest.mark.parametrize(("ticks", "laws"), [(8, set()), (20, {"tasks"})])
def test_a_claim_may_be_wrong_for_the_grace_of_physics(ticks, laws):
    left = replace(pushed(50, 50 + ticks, 0.3), tolerance=(0.01, 0.05), held=[held(0.0)])
    assert PHYSICS.grace == pytest.approx(10 * DT)
    assert verdict(ARM, left, PHYSICS).laws & {"tasks"} == laws


def test_a_task_that_begins_far_away_is_judged_from_when_it_arrived():
    far = held([0.0, 0.02, 0.0])
    run_in = STILL.q.copy()
    assert "tasks" not in verdict(ARM, replace(STILL, tolerance=(0.01, 0.05), held=[far])).laws
    reach = ROBOT.pose(STILL.q[0], ROBOT.joints[JOINT])[0, 3]
    run_in[100:200, 0] += 0.02 / reach  # it arrives, and leaves again
    assert task_errors(ARM, run_in[[150]], far)[0][0] < 0.01 < task_errors(ARM, run_in[[99]], far)[0][0]
    back = replace(STILL, q=run_in, tolerance=(0.01, 0.05), held=[far])
    (breach,) = [one for one in verdict(ARM, back).breaches if one.law == "tasks"]
    assert breach.tick == 200
