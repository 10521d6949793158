"""Collision geometry of a URDF as a thing that stands: where each piece is while all joints are at zero."""

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.model.capsules import Collision
from ftqp.model.reading import urdf
from ftqp.model.reduction import frame_names


def placed_collisions(source: Any) -> list[Collision]:
    """The pieces of a URDF, each with its pose in the world in place of that in its link."""
    found = urdf.read(source, (), ())
    model = found.model
    data, there = model.createData(), frame_names(model)
    pin.forwardKinematics(model, data, pin.neutral(model))
    pin.updateFramePlacements(model, data)
    pieces = []
    for one in found.shapes:
        if isinstance(one, Collision):
            T = data.oMf[model.getFrameId(one.link)].homogeneous if one.link in there else np.eye(4)
            pieces.append(replace(one, place=T @ one.place))
    return pieces


def vertices(shape: Collision) -> FloatArray:
    """The corners of the hull of a mesh in its own frame, (V, 3) [m]."""
    corners: FloatArray = import_module("ftqp.model.capsule_fit").vertices(shape)  # it loads scipy
    return corners
