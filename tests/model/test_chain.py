"""Chain constants against pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from ftqp.core.errors import ModelError
from ftqp.core.pose import rotation_z, transform
from ftqp.model.chain import Chain, chain_of
from ftqp.model.robot import Robot

UNALIGNED_CONTINUOUS = """<robot name="c"><link name="base"/><link name="one"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><parent link="base"/><child
link="one"/> <axis xyz="1 2 -3"/></joint></robot>"""


def random_model(generator: np.random.Generator, count: int) -> pin.Model:
    model = pin.Model()
    model.name = "random"
    parent = 0
    for i in range(count):
        axis = generator.normal(size=3)
        axis /= np.linalg.norm(axis)
        joints = [
            pin.JointModelRX(),
            pin.JointModelRY(),
            pin.JointModelRZ(),
            pin.JointModelPX(),
            pin.JointModelPY(),
            pin.JointModelPZ(),
            pin.JointModelRUBX(),
            pin.JointModelRUBY(),
            pin.JointModelRUBZ(),
            pin.JointModelRevoluteUnaligned(*axis),
            pin.JointModelPrismaticUnaligned(*axis),
        ]
        joint = joints[generator.integers(len(joints))]
        parent = model.addJoint(parent, joint, pin.SE3.Random(), f"j{i}")
        model.appendBodyToJoint(parent, pin.Inertia.Random(), pin.SE3.Random())
    model.addFrame(pin.Frame("tip", parent, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    return model


def poses(chain: Chain, q: np.ndarray) -> list[np.ndarray]:
    """Joint frames by the product of transforms that the docstring of Chain gives, then the tip."""
    T = np.eye(4)
    result = []
    for i, value in enumerate(q):
        move = np.eye(4)
        if chain.prismatic[i]:
            move[2, 3] = value
        else:
            move[:3, :3] = rotation_z(value)
        T = T @ transform(chain.rotation[i], chain.translation[i]) @ move
        result.append(T)
    return [*result, T @ transform(chain.tip_rotation, chain.tip_translation)]


def configuration(model: pin.Model, q: np.ndarray) -> np.ndarray:
    result = []
    for i, value in enumerate(q):
        result += [np.cos(value), np.sin(value)] if model.nqs[i + 1] == 2 else [value]
    return np.array(result)


@pytest.mark.parametrize("seed", range(31))
def test_chain_of_random_mixed_joints_places_the_tip_where_pinocchio_does(seed: int) -> None:
    generator = np.random.default_rng(seed)
    pin.seed(seed)
    model = random_model(generator, 2 + seed)
    chain = chain_of(model, "tip")
    q = generator.uniform(-3.0, 3.0, 2 + seed)
    data = model.createData()
    pin.framesForwardKinematics(model, data, configuration(model, q))
    expected = data.oMf[model.getFrameId("tip")].homogeneous
    assert np.abs(poses(chain, q)[-1] - expected).max() < 1e-12 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("seed", range(0, 31, 5))
def test_potential_and_kinetic_energy_of_the_chain_are_those_of_pinocchio(seed: int) -> None:
    generator = np.random.default_rng(seed)
    pin.seed(seed)
    count = 2 + seed
    model = random_model(generator, count)
    chain = chain_of(model, "tip")
    q, v = generator.uniform(-3.0, 3.0, count), generator.normal(size=count)
    frames = poses(chain, q)[:-1]
    kinetic, potential = 0.0, 0.0
    for i in range(count):
        R, com = frames[i][:3, :3], frames[i][:3, :3] @ chain.com[i] + frames[i][:3, 3]
        linear, angular = np.zeros(3), np.zeros(3)
        for k in range(i + 1):
            z = frames[k][:3, 2]
            if chain.prismatic[k]:
                linear += v[k] * z
            else:
                angular += v[k] * z
                linear += v[k] * np.cross(z, com - frames[k][:3, 3])
        kinetic += (
            0.5 * chain.mass[i] * linear @ linear + 0.5 * angular @ R @ chain.inertia[i] @ R.T @ angular
        )
        potential -= chain.mass[i] * chain.gravity @ com
    data, full = model.createData(), configuration(model, q)
    assert kinetic == pytest.approx(pin.computeKineticEnergy(model, data, full, v), rel=1e-11)
    assert potential == pytest.approx(pin.computePotentialEnergy(model, data, full), rel=1e-11)


def test_continuous_joint_about_a_slanted_axis_is_turned_to_its_z_axis() -> None:
    robot = Robot.from_urdf(UNALIGNED_CONTINUOUS, "one")
    assert robot.chain.continuous.tolist() == [True]
    assert (robot.nq, robot.nv) == (2, 1)
    for angle in (-2.0, 0.0, 3.0):
        assert np.abs(poses(robot.chain, np.array([angle]))[-1] - robot.pose([angle])).max() < 1e-12


@pytest.mark.parametrize(
    ("joint", "kind"), [(pin.JointModelSpherical(), "Spherical"), (pin.JointModelHZ(0.1), "HZ")]
)
def test_joint_that_the_kernel_cannot_express_is_named_with_its_type(joint: object, kind: str) -> None:
    model = pin.Model()
    parent = model.addJoint(0, joint, pin.SE3.Identity(), "shoulder")
    model.addFrame(pin.Frame("tip", parent, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with pytest.raises(ModelError, match=f"'shoulder' is of type {kind}"):
        chain_of(model, "tip")


def test_joint_beside_the_chain_hangs_on_its_own_parent() -> None:
    model = random_model(np.random.default_rng(0), 2)
    assert chain_of(model, "tip").is_serial
    model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "other")
    chain = chain_of(model, "tip")
    assert chain.parent.tolist() == [-1, 0, -1]
    assert (chain.tip_joint, chain.is_serial) == (1, False)
    assert [chain.way(i) for i in range(-1, 3)] == [[], [0], [0, 1], [2]]
