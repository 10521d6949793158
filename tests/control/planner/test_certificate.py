"""A certificate reads as a sentence about the robot."""

import dataclasses

import pytest

from ftqp.control.planner.certificate import Certificate, Obstacle, Unreached

Z = Unreached(direction="z", amount=-0.25)
RX = Unreached(direction="rx", amount=1e-3)
ELBOW = Obstacle(joint="elbow", limit="upper position", weight=1.0)
WRIST = Obstacle(joint="wrist", limit="locked", weight=0.5)


@pytest.mark.parametrize(
    ("unreached", "obstacles", "sentence"),
    [
        (
            (Z, RX),
            (ELBOW, WRIST),
            "the task misses z by -0.25, rx by +0.001; in the way: elbow at upper position, wrist at locked",
        ),
        ((Z,), (), "the task misses z by -0.25; in the way: the arm cannot move that way (singular)"),
        ((), (ELBOW,), "the task misses nothing; in the way: elbow at upper position"),
    ],
)
def test_certificate_is_a_sentence_of_directions_and_joints(unreached, obstacles, sentence):
    assert str(Certificate(unreached=unreached, obstacles=obstacles)) == sentence


def test_certificate_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Certificate(unreached=(Z,), obstacles=()).obstacles = (ELBOW,)
