"""Serial chains of random shape and mixed joint types, as pinocchio models."""

from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.model.robot import Robot

LIMITS = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0, "tau_max": 500.0}


def _axis(rng: np.random.Generator) -> Any:
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def _slanted_continuous(rng: np.random.Generator) -> Any:
    """A continuous joint along no coordinate axis; pinocchio makes one from a URDF only."""
    x, y, z = _axis(rng)
    text = f"""<robot name="one"><link name="a"/><link name="b"/><joint name="j" type="continuous">
    <parent link="a"/><child link="b"/><axis xyz="{x!s} {y!s} {z!s}"/></joint></robot>"""
    return pin.buildModelFromXML(text).joints[1]


KINDS = {
    "RX": lambda rng: pin.JointModelRX(),
    "RY": lambda rng: pin.JointModelRY(),
    "RZ": lambda rng: pin.JointModelRZ(),
    "PX": lambda rng: pin.JointModelPX(),
    "PY": lambda rng: pin.JointModelPY(),
    "PZ": lambda rng: pin.JointModelPZ(),
    "R": lambda rng: pin.JointModelRevoluteUnaligned(_axis(rng)),
    "P": lambda rng: pin.JointModelPrismaticUnaligned(_axis(rng)),
    "CX": lambda rng: pin.JointModelRUBX(),
    "CY": lambda rng: pin.JointModelRUBY(),
    "CZ": lambda rng: pin.JointModelRUBZ(),
    "C": _slanted_continuous,
}


def random_model(rng: np.random.Generator, joints: int, branching: float = 0.0) -> Any:
    """A pinocchio model of ``joints`` joints with rotors, every kind drawn alike, and a frame ``tip``.

    That share of the joints hangs on any joint before it or on the base, the others on the last; the tip of a
    tree is on any joint.
    """
    model = pin.Model()
    kinds = rng.permutation(np.resize(rng.permutation(list(KINDS)), joints))
    for i, kind in enumerate(kinds):
        parent = int(rng.integers(0, i + 1)) if branching and rng.random() < branching else i
        placement = pin.SE3(pin.exp3(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-0.4, 0.4, 3))
        made = model.addJoint(parent, KINDS[kind](rng), placement, f"j{i}_{kind}")
        body = pin.Inertia.FromEllipsoid(rng.uniform(0.5, 5.0), *rng.uniform(0.05, 0.3, 3))
        turned = pin.SE3(pin.exp3(rng.normal(size=3)), rng.uniform(-0.2, 0.2, 3))
        model.appendBodyToJoint(made, body, turned)
    end = pin.SE3(pin.exp3(rng.normal(size=3)), rng.uniform(-0.3, 0.3, 3))
    carries = int(rng.integers(1, joints + 1)) if branching else joints
    model.addFrame(pin.Frame("tip", carries, 0, end, pin.FrameType.OP_FRAME))
    model.armature = rng.uniform(0.0, 1.0, joints)
    model.gravity.linear = rng.uniform(-10.0, 10.0, 3)
    return model


def random_robot(rng: np.random.Generator, joints: int) -> Robot:
    """A robot of ``random_model`` with gravity along no axis."""
    return Robot.from_pinocchio(random_model(rng, joints), "tip", limits=LIMITS, name="random chain")


def configuration(rng: np.random.Generator, robot: Robot) -> tuple[Any, Any, Any]:
    """Joint values (nv,) in [-3, 3], pinocchio's configuration (nq,) for them, and velocities (nv,)."""
    q = rng.uniform(-3.0, 3.0, robot.nv)
    return q, robot.configuration(q), rng.uniform(-2.0, 2.0, robot.nv)
