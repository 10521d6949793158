"""A robot written as URDF and read back: by ftqp, and by pinocchio and MuJoCo, which know nothing of it."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.model.urdf_text import link_names

LIMITS = ("q_min", "q_max", "v_max", "a_max", "tau_max", "j_max")
ALL = [*catalog.names(), "planar(3)"]


def postures(robot: Robot, count: int = 5) -> np.ndarray:
    low = np.maximum(robot.limits.q_min, -2.0)
    return np.random.default_rng(3).uniform(low, np.minimum(robot.limits.q_max, 2.0), (count, robot.nv))


def same_everywhere(robot: Robot, again: Robot) -> None:
    """Poses, M, h and limits to 1e-12 of their size."""
    for name in LIMITS:
        np.testing.assert_array_equal(getattr(again.limits, name), getattr(robot.limits, name), name)
    assert again.joints == robot.joints
    assert (again.viscous == robot.viscous).all() and (again.coulomb == robot.coulomb).all()
    for q in postures(robot):
        np.testing.assert_allclose(again.pose(q), robot.pose(q), rtol=0.0, atol=1e-12)
        if robot.has_inertia:
            M, h = robot.mass_matrix(q), robot.bias(q, 0.3 * q)
            np.testing.assert_allclose(again.mass_matrix(q), M, rtol=0.0, atol=1e-12 * np.abs(M).max())
            np.testing.assert_allclose(
                again.bias(q, 0.3 * q), h, rtol=0.0, atol=1e-12 * max(1.0, np.abs(h).max())
            )


@pytest.mark.parametrize("name", ALL)
def test_robot_of_the_catalog_comes_back(name: str) -> None:
    robot = catalog.load(name)
    given = {"gravity": robot.chain.gravity, "neutral": robot.neutral}
    again = Robot.from_urdf(robot.to_urdf(), tips=robot.tips, **given)
    same_everywhere(robot, again)
    assert (again.name, again.tips) == (robot.name, robot.tips)


@pytest.mark.parametrize("name", ALL)
def test_pinocchio_reads_the_same_arm(name: str) -> None:
    robot = catalog.load(name)
    model = pin.buildModelFromXML(robot.to_urdf())
    model.gravity = robot.model.gravity
    model.armature = robot.chain.armature
    assert list(model.names)[1:] == list(robot.joints)
    data, tip = model.createData(), model.getFrameId(link_names(robot.joints, robot.tips)[robot.nv + 1])
    for q in postures(robot):
        at = np.concatenate(
            [[np.cos(x), np.sin(x)] if model.joints[i + 1].nq == 2 else [x] for i, x in enumerate(q)]
        )
        pin.framesForwardKinematics(model, data, at)
        np.testing.assert_allclose(data.oMf[tip].homogeneous, robot.pose(q), rtol=0.0, atol=1e-12)
        if robot.has_inertia:
            M = pin.crba(model, data, at)
            M = np.triu(M) + np.triu(M, 1).T
            np.testing.assert_allclose(M, robot.mass_matrix(q), rtol=0.0, atol=1e-12 * np.abs(M).max())


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_mujoco_reads_the_same_arm(name: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    robot = catalog.load(name)
    kept = '<mujoco><compiler fusestatic="false" discardvisual="false"/></mujoco></robot>'
    model = mujoco.MjModel.from_xml_string(robot.to_urdf().replace("</robot>", kept))
    data = mujoco.MjData(model)
    assert model.nv == robot.nv
    assert model.ngeom >= robot.nv  # cylinders to look at
    for q in postures(robot):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        tip = data.body(link_names(robot.joints, robot.tips)[robot.nv + 1])
        np.testing.assert_allclose(tip.xpos, robot.pose(q)[:3, 3], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(tip.xmat.reshape(3, 3), robot.pose(q)[:3, :3], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["bell\a", "null\0", "half \ud800", ""])
def test_name_that_xml_cannot_hold_is_refused(name: str) -> None:
    robot = catalog.load("planar(3)")
    chain = robot.chain
    odd = replace(robot, chain=replace(chain, names=(name, *chain.names[1:])))
    with pytest.raises(InputError, match="cannot stand in a URDF"):
        odd.to_urdf()


def test_rotors_and_accelerations_stand_where_drake_reads_them() -> None:
    robot = catalog.load("panda")
    root = ElementTree.fromstring(robot.to_urdf())
    drake = "{http://drake.mit.edu}"
    limit = root.findall("joint/limit")
    assert [float(x.get(f"{drake}acceleration", "")) for x in limit] == robot.limits.a_max.tolist()
    rotors = root.findall(f"transmission/actuator/{drake}rotor_inertia")
    assert [float(x.get("value", "")) for x in rotors] == [x for x in robot.chain.armature if x]


def test_shapes_without_all_their_sizes_are_left_out_aloud(caplog) -> None:
    """A box of two edges is none, and who scales a mesh by two numbers does not mean 1."""
    text = (
        '<robot name="a"><link name="b"><collision><geometry><box size="1 1"/></geometry></collision></link>'
        '<joint name="j" type="revolute"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="9"/></joint>'
        '<link name="c"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><mesh filename="x.stl" scale="1 1"/></geometry></collision></link></robot>'
    )
    Robot.from_urdf(text, tip="c")
    assert "the box of link 'b' has the sizes [1.0, 1.0], expected 3 finite numbers" in caplog.text
    assert "the mesh of link 'c' has the sizes [1.0, 1.0], expected 3 finite numbers" in caplog.text
