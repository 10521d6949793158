"""Frames of a model posture after posture are where a single look finds them."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.model import catalog
from ftqp.model.frames import PlacedFrames

NAMES = ["panda_joint4", "panda_hand_tcp", "universe", "panda_joint4"]


def test_frames_and_centre_of_mass_follow_the_posture():
    robot = catalog.load("panda")
    frames = PlacedFrames(robot, NAMES)
    for shift in (0.0, 0.3, -0.2):
        q = robot.neutral + shift
        expected = [robot.pose(q, name) for name in NAMES]
        np.testing.assert_allclose(frames.at(q), expected, atol=1e-14)
    assert PlacedFrames(robot, []).at(robot.neutral).shape == (0, 4, 4)


def test_unknown_frame_is_refused():
    with pytest.raises(InputError, match="did you mean 'panda_joint4'"):
        PlacedFrames(catalog.load("panda"), ["panda_joint44"])
