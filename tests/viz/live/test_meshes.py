"""An arm drawn from the meshes of its URDF, and from its chain where they cannot be read."""

import numpy as np
import pytest

import ftqp
from ftqp.viz.live.meshes import BASE, arm_parts, mesh_parts

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
