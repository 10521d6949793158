"""The law of bodies that keep apart: what it lets pass and what it finds."""

from dataclasses import replace

import numpy as np
import pytest
from tests.checker.test_run_laws import ARM, JOINT, ROBOT, run

import ftqp
from ftqp.checker.checked_run import verdict
from ftqp.checker.trace import Body, Cone, Failure, Thing

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
