"""Robots with branches, for tests of the model: joints of every kind, a tip on several of them."""

import numpy as np
import pinocchio as pin
from tests.kernel.random_chains import random_model

from ftqp.model.robot import Robot


def random_tree(rng: np.random.Generator, count: int) -> tuple[pin.Model, list[str]]:
    """A model of ``count`` joints in any order with parents first, and a tip on each that carries none."""
    model = random_model(rng, count, 0.4)
    model.name, model.damping = "tree", rng.uniform(0.0, 1.0, count)
    tips = []
    for i in range(1, count + 1):
        model.addJointFrame(i)
        if i not in list(model.parents)[1:]:
            tips.append(f"tip{i}")
            place = pin.SE3(pin.exp3(rng.normal(size=3)), rng.uniform(-0.3, 0.3, 3))
            model.addFrame(pin.Frame(tips[-1], i, place, pin.FrameType.OP_FRAME))
    return model, tips


def random_robot(rng: np.random.Generator, count: int) -> tuple[Robot, pin.Model]:
    """A robot with all the joints of a random tree, and that tree; the order of joints may differ."""
    model, tips = random_tree(rng, count)
    chosen = [str(name) for name in rng.permutation(tips)]
    limits = {"q_min": -3.0, "q_max": 3.0, "v_max": 2.0, "a_max": 5.0, "tau_max": np.inf}
    return Robot.from_pinocchio(model, tips=chosen, limits=limits), model


def positions_in(model: pin.Model, robot: Robot, q: np.ndarray) -> np.ndarray:
    """Joint values of a robot as the configuration, (nq,), of a model with the same joints."""
    full = np.empty(model.nq)
    for name, value in zip(robot.joints, q, strict=True):
        i = model.getJointId(name)
        at = model.idx_qs[i]
        full[at : at + model.nqs[i]] = (np.cos(value), np.sin(value)) if model.nqs[i] == 2 else value
    return full


def order_in(model: pin.Model, robot: Robot) -> list[int]:
    """Which velocity of a model each joint of a robot has."""
    return [model.idx_vs[model.getJointId(name)] for name in robot.joints]
