"""A fault of every kind, drawn at random: with these the laws are tested. A new kind is a line."""

import ftqp


def _degraded(generator, joint):
    shares = generator.uniform(0.2, 1.0, 3)
    return ftqp.Degraded(joint, velocity=shares[0], acceleration=shares[1], torque=max(shares[2], 0.6))


FAULTS = (
    (ftqp.Locked, lambda _, joint: ftqp.Locked(joint)),
    (ftqp.Locked, lambda _, joint: ftqp.Locked(joint)),
    (ftqp.Degraded, _degraded),
    (
        ftqp.FreeSwinging,
        lambda generator, i: ftqp.FreeSwinging(i, damping=float(generator.uniform(0.0, 5.0))),
    ),
)
"""Each kind as often as it is to be drawn, and how it is drawn for a joint."""


def draw_fault(generator, robot, swings=True):
    """A random fault of a random joint; nothing swings freely on an arm without inertia.

    Args:
        generator: What draws.
        robot: The arm.
        swings: Whether joints may swing freely.
    """
    joint = int(generator.integers(robot.nv))
    swings = swings and robot.has_inertia
    drawn = [draw for kind, draw in FAULTS if swings or kind is not ftqp.FreeSwinging]
    return drawn[int(generator.integers(len(drawn)))](generator, joint)
