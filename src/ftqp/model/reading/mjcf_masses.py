"""Masses of an MJCF file that stand in its geoms, which MuJoCo computes and pinocchio does not."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.model.reading.mjcf_geometry import compiled


def weigh(model: Any, text: str, path: Path | None) -> None:
    """Give a pinocchio model without masses those that MuJoCo gives its bodies, by the bodies' names.

    A body without joints moves with the one that it is fixed to.

    Args:
        model: The model, whose inertias are written.
        text: The MJCF.
        path: Its file, or None.

    Raises:
        InputError: MuJoCo refuses the file.
    """
    from ftqp.model.reading.mujoco_package import mujoco

    read = compiled(text, path)
    data = mujoco.MjData(read)
    mujoco.mj_kinematics(read, data)
    places = [pin.SE3(data.xmat[b].reshape(3, 3).copy(), data.xpos[b].copy()) for b in range(read.nbody)]
    for b in range(1, read.nbody):
        root = int(read.body_weldid[b])
        name = read.body(root).name
        if read.body_mass[b] <= 0.0 or root == 0 or not model.existFrame(name):
            continue
        frame = model.frames[model.getFrameId(name)]
        turned = np.empty(9)
        mujoco.mju_quat2Mat(turned, read.body_iquat[b])
        R = turned.reshape(3, 3)
        inertia = pin.Inertia(
            float(read.body_mass[b]), read.body_ipos[b].copy(), R @ np.diag(read.body_inertia[b]) @ R.T
        )
        place = frame.placement * (places[root].inverse() * places[b])
        model.inertias[frame.parentJoint] += place.act(inertia)
