"""Trees of joints of every kind, as pinocchio models: a joint hangs on any before it, or on the base."""

from typing import Any

import numpy as np
import pinocchio as pin
from random_chains import KINDS


def random_tree(rng: np.random.Generator, joints: int) -> Any:
    """A pinocchio model of ``joints`` joints with rotors, and a frame ``tip`` on one of them.

    One joint in three hangs on any joint before it or on the base, the others on the last.
    """
    model = pin.Model()
    kinds = rng.permutation(np.resize(rng.permutation(list(KINDS)), joints))
    for i, kind in enumerate(kinds):
        parent = int(rng.integers(0, i + 1)) if rng.random() < 0.35 else i
        placement = pin.SE3(pin.exp3(rng.uniform(-2.0, 2.0, 3)), rng.uniform(-0.4, 0.4, 3))
        made = model.addJoint(parent, KINDS[kind](rng), placement, f"j{i}_{kind}")
        body = pin.Inertia.FromEllipsoid(rng.uniform(0.5, 5.0), *rng.uniform(0.05, 0.3, 3))
        model.appendBodyToJoint(made, body, pin.SE3(pin.exp3(rng.normal(size=3)), rng.uniform(-0.2, 0.2, 3)))
    end = pin.SE3(pin.exp3(rng.normal(size=3)), rng.uniform(-0.3, 0.3, 3))
    model.addFrame(pin.Frame("tip", int(rng.integers(1, joints + 1)), 0, end, pin.FrameType.OP_FRAME))
    model.armature = rng.uniform(0.0, 1.0, joints)
    model.gravity.linear = rng.uniform(-10.0, 10.0, 3)
    return model


def configuration(rng: np.random.Generator, model: Any) -> tuple[Any, Any, Any]:
    """Joint values (nv,), pinocchio's configuration (nq,) for them, and velocities (nv,)."""
    q, full = rng.uniform(-3.0, 3.0, model.nv), np.empty(model.nq)
    for i, at in enumerate(model.idx_qs[1:]):
        if model.nqs[i + 1] == 2:
            full[at : at + 2] = np.cos(q[i]), np.sin(q[i])
        else:
            full[at] = q[i]
    return q, full, rng.uniform(-2.0, 2.0, model.nv)
