"""What a frame holds, and how an arm is drawn of it: barrels, links and meshes."""

from dataclasses import fields

import numpy as np
import pytest

import ftqp
from ftqp.app.scenario.setup import load
from ftqp.app.view.live_source import arms_of
from ftqp.faults.kinds import KINDS
from ftqp.model import catalog
from ftqp.model.catalog import CATALOG
from ftqp.model.chain import ends_of
from ftqp.sim.log.signals import CONDITIONS
from ftqp.sim.loop import Simulation
from ftqp.sim.session.frame import DrawnArm, frames_of
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.viz.live import colours
from ftqp.viz.live.meshes import BASE, arm_parts, mesh_parts, radii, size_of

CLOCK = {"step_time_us", "speed"}


def session(scenario, **kwargs):
    return Session(lambda choice: arms_of(choice, rival=False), Choice(scenario=scenario, **kwargs))


def framed(arm, **given):
    """A picture at rest, all healthy unless it is said."""
    robot, healthy = arm.robot, arm.codes({})
    known = {
        "tick": 7, "t": 0.007, "q": robot.neutral, "v": np.zeros(robot.nv), "truth": healthy,
        "belief": healthy, "target": np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    }  # fmt: skip
    return arm.frame(**{**known, **given})


def different(one, other):
    return {
        name
        for name in (field.name for field in fields(one))
        if not np.array_equal(np.asarray(getattr(one, name)), np.asarray(getattr(other, name)))
    } - CLOCK


@pytest.mark.parametrize(
    ("scenario", "early"), [("panda-circle", ("faults.0.at=0.1",)), ("modular11-locked", ())]
)
def test_frames_of_a_log_are_those_of_the_session_bit_by_bit(scenario, early):
    setup = load(scenario, early)
    log = Simulation(
        setup.planner, setup.path, q=setup.q, v=setup.v, schedule=setup.schedule, plant=setup.plant,
        follower=setup.follower, duration=0.4, log="memory",
    ).run().log  # fmt: skip
    live = session(scenario, overrides=early)
    dt = setup.planner.dt
    ticks = range(0, len(log), 7)
    compared = 0
    for frame in frames_of(log, setup.robot, ticks):
        if frame.tick:
            assert live.advance(7 * dt) == 7
        assert different(live.frame, frame) == set(), frame.tick
        compared += 1
    assert compared == len(ticks) > 5


@pytest.mark.parametrize("name", ["panda", "modular11", "planar6", "zhang7"])
def test_last_pose_is_the_tip_and_ellipsoid_that_of_the_jacobian(name):
    robot = catalog.load(name)
    q = robot.neutral + 0.1
    frame = framed(DrawnArm(robot), q=q)
    np.testing.assert_allclose(frame.joints[-1], robot.pose(q), atol=1e-12)
    np.testing.assert_array_equal(frame.tip, frame.joints[-1])
    J = robot.jacobian(q)[:3]
    R, axes = frame.axes_rotation, frame.axes
    np.testing.assert_allclose(R @ np.diag(axes**2) @ R.T, J @ J.T, atol=1e-9 * axes[0] ** 2)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_joint_that_failed_or_is_believed_to_flattens_the_ellipsoid():
    robot = catalog.load("planar6")
    arm, n = DrawnArm(robot), robot.nv
    J = robot.jacobian(robot.neutral)[:3]
    for truth, belief in ((1, 0), (0, 2), (2, 2)):
        codes = np.zeros((2, n), dtype=int)
        codes[0, 1], codes[1, 1] = truth, belief
        frame = framed(arm, truth=codes[0], belief=codes[1])
        np.testing.assert_allclose(frame.axes, np.linalg.svd(np.delete(J, 1, axis=1))[1], atol=1e-12)
    weak = np.full(n, 3)
    np.testing.assert_allclose(framed(arm, truth=weak).axes, np.linalg.svd(J)[1], atol=1e-12)


def placed(robot, parts, q):
    """Corners of the parts in the base frame, by part, with the frames by a plain product of poses."""
    chain, poses = robot.chain, []
    for i in range(robot.nv):
        step, joint = np.eye(4), np.eye(4)
        step[:3, :3], step[:3, 3] = chain.rotation[i], chain.translation[i]
        if chain.prismatic[i]:
            joint[2, 3] = q[i]
        else:
            joint[:2, :2] = [[np.cos(q[i]), -np.sin(q[i])], [np.sin(q[i]), np.cos(q[i])]]
        above = poses[chain.parent[i]] if chain.parent[i] >= 0 else np.eye(4)
        poses.append(above @ step @ joint)
    poses.append(np.eye(4))
    return {p.name: p.mesh.vertices @ poses[p.frame][:3, :3].T + poses[p.frame][:3, 3] for p in parts}


@pytest.mark.parametrize("name", CATALOG)
def test_every_joint_has_a_barrel_and_links_reach_from_joint_to_joint(name):
    robot = ftqp.robots.load(name)
    parts = arm_parts(robot)
    assert [p.frame for p in parts if p.kind == "joint"] == list(range(robot.nv))
    assert [p.frame for p in parts if p.kind == "base"] == [BASE]
    assert len({p.name for p in parts}) == len(parts)
    for part in parts:
        assert np.isfinite(part.mesh.vertices).all()
        assert part.mesh.faces.min() >= 0
        assert part.mesh.faces.max() < len(part.mesh.vertices)
    corners = placed(robot, parts, robot.neutral)
    for name, tip in zip(("tip", "tip1"), robot.tips, strict=False):
        at = robot.pose(robot.neutral, tip)[:3, 3]
        assert np.linalg.norm(corners[name].mean(axis=0) - at) < 0.2 * radii(robot.chain)[-1]
    assert len([p for p in parts if p.kind == "tip"]) == len(robot.tips)
    chain = robot.chain
    ends = [*zip(chain.parent, chain.translation, strict=True)]
    ends += [(body, at) for body, _, at in ends_of(robot.model, robot.tips)]
    linked = {p.frame for p in parts if p.kind == "link"}
    far = {i for i, end in ends if i >= 0 and np.linalg.norm(end) > 0.01 * size_of(chain)}
    assert linked >= far
    for i, end in ends:
        if i in far:
            mesh = next(p.mesh for p in parts if p.name == f"link{i}")
            assert np.linalg.norm(mesh.vertices - end, axis=1).min() < 1.5 * radii(chain)[i]


def test_every_condition_has_a_colour_of_its_own():
    assert set(colours.CONDITION) == set(CONDITIONS) == {0, *(kind.number for kind in KINDS.values())}
    shown = [*colours.CONDITION.values(), colours.BRAKING, colours.NEAR_LIMIT]
    assert len(set(shown)) == len(shown)


URDF = """<robot name="two">
  <link name="base"><collision><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision></link>
  <link name="upper"><collision><origin xyz="0.25 0 0" rpy="0 1.5707963267948966 0"/>
    <geometry>{shape}</geometry></collision></link>
  <link name="tip"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
  <joint name="b" type="revolute"><origin xyz="0.5 0 0"/>
    <parent link="upper"/><child link="tip"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
</robot>"""
CYLINDER = '<cylinder radius="0.04" length="0.5"/>'
STL = """solid one
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1000 0 0
vertex 0 1000 0
endloop
endfacet
endsolid one
"""


def arm(urdf):
    return ftqp.Robot.from_urdf(urdf, tip="tip", acceleration=5.0)


def test_a_body_stands_where_its_urdf_says_whatever_the_axis_of_its_joint():
    urdf = URDF.format(shape=CYLINDER)
    robot = arm(urdf)
    parts = {part.name: part for part in mesh_parts(robot, urdf)}
    assert {name: part.frame for name, part in parts.items()} == {"body0": BASE, "body1": 0, "joint1": 1}
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = robot.chain.rotation[0], robot.chain.translation[0]
    corners = parts["body1"].mesh.vertices @ T[:3, :3].T + T[:3, 3]
    assert np.allclose(corners.min(axis=0)[0], 0.0, atol=1e-12)
    assert np.allclose(corners.max(axis=0)[0], 0.5, atol=1e-12)
    assert np.abs(corners[:, 1:]).max() == pytest.approx(0.04)


def test_meshes_are_found_in_the_package_above_and_scaled(tmp_path):
    folder = tmp_path / "arm_description" / "urdf"
    meshes = tmp_path / "arm_description" / "meshes"
    folder.mkdir(parents=True)
    meshes.mkdir()
    (meshes / "one.stl").write_text(STL)
    name = "package://arm_description/meshes/one.stl"
    file = folder / "arm.urdf"
    file.write_text(URDF.format(shape=f'<mesh filename="{name}" scale="0.001 0.001 0.001"/>'))
    (body,) = (part for part in mesh_parts(arm(file), file) if part.name == "body1")
    assert len(body.mesh.faces) == 1
    assert np.ptp(body.mesh.vertices, axis=0).max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ('<mesh filename="package://nowhere/none.stl"/>', "was not found"),
        ('<mesh filename="bad.stl"/>', "bad.stl"),
        ('<mesh filename="bad.dae"/>', "bad.dae"),
    ],
)
def test_what_cannot_be_read_costs_the_meshes_and_not_the_picture(tmp_path, capsys, shape, reason):
    (tmp_path / "bad.stl").write_bytes(b"\x00" * 90)
    (tmp_path / "bad.dae").write_text("<COLLADA>")
    (tmp_path / "one.stl").write_text(STL)
    file = tmp_path / "arm.urdf"
    file.write_text(URDF.format(shape=shape))
    robot = arm(URDF.format(shape=CYLINDER))
    parts = mesh_parts(robot, file)
    assert [part.name for part in parts] == [part.name for part in arm_parts(robot)]
    said = capsys.readouterr().err
    assert said.startswith("ftqp: two is drawn from its chain: ")
    assert reason in said
    assert said.count("\n") == 1
