"""Certificate: why a task cannot be followed exactly, in the words of the robot."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Unreached:
    """A direction of the task and how much of it is missing.

    Attributes:
        direction: x, y, z, rx, ry or rz, along W (along the tool for ``position_axis``).
        amount: motion minus what the task asks, [m/s2] or [rad/s2]; at the velocity level [m/s] or [rad/s].
    """

    direction: str
    amount: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A bound that stands in the way.

    Attributes:
        joint: its joint.
        limit: ``upper position``, ``lower velocity``, ``upper torque``, ``locked`` and the like.
        weight: its share of the obstruction, the multipliers scaled to a largest of 1.
    """

    joint: str
    limit: str
    weight: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Which task directions cannot be kept, by how much, and which bounds stand in the way.

    At the best feasible command the residual s = A x - b and the multipliers of the active bounds satisfy A's
    + z = 0 up to
    the objective: moving along -s would need one of those bounds to give.

    Attributes:
        unreached: directions with their missing amounts, largest first.
        obstacles: active bounds, heaviest first.
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
