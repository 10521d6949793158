"""An arm drawn from the meshes of its URDF, and from its chain where they cannot be read."""

import sys
from importlib import util
from pathlib import Path

import numpy as np
import pytest

import ftqp
from ftqp.core.errors import InputError
from ftqp.viz.live.meshes import MOST_FACES, found_mesh, mesh_parts, read_mesh, simplified
from ftqp.viz.live.shapes import BASE, arm_parts
from ftqp.viz.live.solids import ball, box

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
ROBOT_DATA = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)
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
    assert found_mesh(name, file) == meshes / "one.stl"
    assert found_mesh("../meshes/one.stl", file).samefile(meshes / "one.stl")
    (body,) = (part for part in mesh_parts(arm(file), file) if part.name == "body1")
    assert len(body.mesh.faces) == 1
    assert np.ptp(body.mesh.vertices, axis=0).max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        ('<mesh filename="package://nowhere/one.stl"/>', "was not found"),
        ('<mesh filename="bad.stl"/>', "bad.stl"),
        ('<mesh filename="bad.dae"/>', "bad.dae"),
        ('<cylinder radius="x" length="1"/>', "not 1 finite numbers"),
        ('<mesh filename="one.stl" scale="1 nan 1"/>', "not 3 finite numbers"),
        ("<torus/>", "is no shape"),
        ("", "has no geometry"),
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
    assert [part.name for part in parts] == [part.name for part in arm_parts(robot.chain)]
    said = capsys.readouterr().err
    assert said.startswith("ftqp: two is drawn from its chain: ")
    assert reason in said
    assert said.count("\n") == 1


def test_no_urdf_and_the_look_of_the_chain_need_no_mesh(capsys):
    robot = ftqp.robots.load("panda")
    assert len(mesh_parts(robot, None)) == len(mesh_parts(robot, "x", "chain")) == len(arm_parts(robot.chain))
    assert capsys.readouterr().err == ""
    with pytest.raises(InputError, match="meshes is 'nice', expected one of chain, collision, visual"):
        mesh_parts(robot, None, "nice")


def test_simplified_meshes_are_light_and_keep_their_shape():
    fine = ball(0.5)
    while len(fine.faces) < 3000:
        middles = fine.vertices[fine.faces].mean(axis=1)
        count = len(fine.vertices) + np.arange(len(fine.faces))
        a, b, c = fine.faces.T
        faces = [np.column_stack(f) for f in ((a, b, count), (b, c, count), (c, a, count))]
        fine = type(fine)(np.vstack([fine.vertices, middles]), np.vstack(faces))
    light, same = simplified([fine, box(np.ones(3))], most=800)
    assert len(light.faces) + len(same.faces) <= 800
    assert len(light.faces) > 200
    assert np.ptp(light.vertices, axis=0) == pytest.approx(np.ones(3), abs=0.12)
    assert simplified([fine], most=10_000)[0] is fine


@pytest.mark.robots
@pytest.mark.skipif(ROBOT_DATA is None, reason='example-robot-data is missing: pip install -e ".[robots]"')
def test_panda_has_light_collision_meshes_and_visual_ones_fall_back_without_their_reader(capsys):
    file = ROBOT_DATA / "panda_description" / "urdf" / "panda.urdf"
    robot = ftqp.Robot.from_urdf(
        file, tip="panda_link8", acceleration=5.0, locked=["panda_finger_joint1", "panda_finger_joint2"]
    )
    parts = mesh_parts(robot, file)
    assert capsys.readouterr().err == ""
    assert {part.frame for part in parts} == {BASE, *range(7)}
    assert sum(len(part.mesh.faces) for part in parts) <= MOST_FACES
    assert all(np.abs(part.mesh.vertices).max() < 0.6 for part in parts)
    assert {part.kind for part in parts} == {"base", "body"}
    if util.find_spec("collada") is None:
        assert any(part.kind == "link" for part in mesh_parts(robot, file, "visual"))
        assert capsys.readouterr().err.count("\n") == 1


def test_a_file_that_is_no_mesh_is_refused(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text("nothing")
    with pytest.raises(InputError, match=r"a\.obj"):
        read_mesh(file)
