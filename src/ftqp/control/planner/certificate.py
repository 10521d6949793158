"""Certificate: why a task cannot be followed exactly, in the words of the robot."""

from dataclasses import dataclass

WITHOUT_BOUND = {
    "singular": "the arm cannot move that way (singular)",
    "calm": "no limit, but the damping with which the arm comes to rest (calm)",
    "no answer": "no limit, but a solver without a usable answer",
    "objective": "no limit, but the scheme and the softness of the task",
    "": "nothing",
}
"""What holds an arm back where no bound does, in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Unreached:
    """A direction of the task and how much of it is missing.

    Attributes:
        direction: One of x, y, z, rx, ry, rz, along W (along the tool for ``position_axis``).
        amount: The motion minus what the task asks for, in its unit.
        unit: m/s2 or rad/s2; at the velocity level m/s or rad/s.
    """

    direction: str
    amount: float
    unit: str


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
class Outside:
    """A limit that a joint does not keep as it is measured or believed.

    Attributes:
        joint: The joint's name.
        limit: Which limit it is: ``upper position``, ``lower position``, ``upper velocity`` or
            ``lower velocity``; of a failed joint the ends of its healthy range.
        amount: By how much the joint is beyond it, > 0, in its unit.
        unit: rad or rad/s; of a joint that slides m or m/s.
    """

    joint: str
    limit: str
    amount: float
    unit: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """Which task directions cannot be kept, by how much, and which bounds stand in the way.

    At the best feasible command the residual s = A x - b and the multipliers z of the active bounds satisfy
    A's + z = 0 up to the objective: moving along -s would need one of those bounds to give.

    Attributes:
        unreached: The directions with their missing amounts, largest first.
        obstacles: The active bounds, heaviest first.
        outside: The limits that joints do not keep, in the order of the joints.
        jump: The share of an instant lock's velocity jump that the other joints have made, 0 to 1; less than
            1 where the whole of it would break a speed limit or leave no room to stop.
        without_bound: What holds the arm back where no bound does: ``singular``, which is said where the
            joints that work can hardly move the tip the way that is missing; ``calm``, the damping with which
            an arm comes to rest; ``no answer`` of a solver; ``objective``, which outweighs a soft task. Empty
            where a bound does, or nothing is missing.
    """

    unreached: tuple[Unreached, ...]
    obstacles: tuple[Obstacle, ...]
    outside: tuple[Outside, ...] = ()
    jump: float = 1.0
    without_bound: str = ""

    def __str__(self) -> str:
        missing = ", ".join(f"{u.direction} by {u.amount:+.3g} {u.unit}" for u in self.unreached) or "nothing"
        bounds = ", ".join(f"{o.joint} at {o.limit}" for o in self.obstacles)
        because = bounds or WITHOUT_BOUND[self.without_bound]
        beyond = ", ".join(f"{o.joint} beyond {o.limit} by {o.amount:.3g} {o.unit}" for o in self.outside)
        said = [f"the task misses {missing}; in the way: {because}"] if self.unreached or not beyond else []
        said += [f"outside: {beyond}"] if beyond else []
        said += [f"{self.jump:.0%} of the jump at the lock was made"] if self.jump < 1.0 else []
        return "; ".join(said)
