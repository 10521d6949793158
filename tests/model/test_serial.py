"""Building serial models."""

import numpy as np
import pytest

from ftqp.model.limits import JointLimits
from ftqp.model.serial import Body, Inertial, placement, rotation_rpy, serial_model


def test_roll_pitch_yaw_turn_about_fixed_axes() -> None:
    assert rotation_rpy(0.0, 0.0, np.pi / 2) @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0])
    both = rotation_rpy(np.pi / 2, 0.0, np.pi / 2)
    assert both @ [0.0, 1.0, 0.0] == pytest.approx([0.0, 0.0, 1.0])
    assert both @ [0.0, 0.0, 1.0] == pytest.approx([1.0, 0.0, 0.0])


def test_parts_of_a_body_are_lumped() -> None:
    point = Inertial(mass=1.0, com=np.zeros(3), inertia=np.zeros((3, 3)))
    parts = [(placement((x, 0.0, 0.0)), point) for x in (-1.0, 1.0)]
    body = Body(name="j", placement=np.eye(4), parts=parts)
    model = serial_model("dumbbell", [body], JointLimits.of(1, v_max=1.0), frames=[("tip", np.eye(4))])
    assert model.inertias[1].mass == 2.0
    assert np.asarray(model.inertias[1].inertia) == pytest.approx(np.diag([0.0, 2.0, 2.0]))
    assert model.gravity.linear.tolist() == [0.0, 0.0, -9.81]
