"""Certificate: why a task cannot be followed exactly, in the words of the robot."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Unreached:
    """A direction of the task and how much of it is missing.

    Attributes:
        direction: One of x, y, z, rx, ry, rz, along W (along the tool for ``position_axis``).
        amount: The motion minus what the task asks for, [m/s2] or [rad/s2]; at the velocity level [m/s] or
            [rad/s].
    """

    direction: str
    amount: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A bound that stands in the way.

    Attributes:
        joint: The joint's name.
        limit: Which bound it is: ``upper position``, ``lower velocity``, ``upper torque``, ``locked`` and
            the like.
        weight: How much it stands in the way, 0 to 1 without unit: its multiplier over the largest one.
    """

    joint: str
    limit: str
    weight: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Which task directions cannot be kept, by how much, and which bounds stand in the way.

    At the best feasible command the residual s = A x - b and the multipliers z of the active bounds satisfy
    A's + z = 0 up to the objective: moving along -s would need one of those bounds to give.

    Attributes:
        unreached: The directions with their missing amounts, largest first.
        obstacles: The active bounds, heaviest first.
    """

    unreached: tuple[Unreached, ...]
    obstacles: tuple[Obstacle, ...]

    def __str__(self) -> str:
        missing = ", ".join(f"{u.direction} by {u.amount:+.3g}" for u in self.unreached) or "nothing"
        because = (
            ", ".join(f"{o.joint} at {o.limit}" for o in self.obstacles)
            or "the arm cannot move that way (singular)"
        )
        return f"the task misses {missing}; in the way: {because}"
