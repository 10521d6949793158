"""The small motion by which an arm is connected: each joint alone, then all of them together."""

from dataclasses import dataclass
from typing import Final, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray, read_only
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot

REACH: Final = {False: 0.08, True: 0.02}
"""How far a joint goes at most: one that turns [rad], 4.6 degrees, and one that slides [m]. A convention."""
SHARE: Final = 0.3
"""Of the limits of speed and acceleration, as nothing is known of the drives yet."""
GENTLE: Final = 1.0
"""No joint speeds up faster than to its limit within such a time [s]: weak servos follow that, too."""
ROOM: Final = 0.5
"""Share of the way to the farther end of its range that a joint goes at most."""
STILL: Final = 0.3
"""The arm stands for so long before and after [s]: its droop and its noise show."""
PAUSE: Final = 0.15
"""After its own motion a joint has so long to come to rest [s], before the next one moves."""
TOGETHER: Final = 0.4
"""Share of the time in which all joints move."""
QUICKEST: Final = 0.4
"""A joint's own motion takes so long at least [s]: a servo of 3 Hz follows it by three quarters."""
LONG, EASY = 10.0, 1.4
"""About how long it takes where nobody says [s], and so many times the shortest at least. A convention."""
WAVES: Final = (2, 6)
"""How often joints go to and fro while all move: within 4 s these are fastest at the accelerations above."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstMotion:
    """Motions from a posture and back to it, of a joint alone and of all at once.

    q(x) = q_0 + A sin^2(pi x) sin^2(k pi x), x from 0 to 1 in the time of a part; position, velocity and
    acceleration go on smoothly, and each joint stays on one side of where it began.

    Attributes:
        start: Where it begins and ends, (nv,) [rad or m].
        alone: A of each joint when it moves alone, towards the middle of its range, (nv,) [rad or m].
        together: A of each joint while all move, (nv,) [rad or m].
        waves: k while all move, (nv,).
        order: The joints that move alone, in their order.
        seconds: How long a joint moves alone, and all together [s].
        lead: The joint that moves each one, itself where it has a motor, (nv,).
        ratio: By how much, (nv,).
    """

    start: FloatArray
    alone: FloatArray
    together: FloatArray
    waves: IntArray
    order: tuple[int, ...]
    seconds: tuple[float, float]
    lead: IntArray
    ratio: FloatArray

    def __post_init__(self) -> None:
        read_only(self)

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return self._begins(len(self.order)) + self.seconds[1] + PAUSE + STILL

    def _begins(self, part: int) -> float:
        """When a part begins [s]."""
        return STILL + part * (self.seconds[0] + PAUSE)

    def part(self, t: float) -> int:
        """The part of a time [s]: -1 while the arm stands at first, the place in ``order``, then the next."""
        return -1 if t < STILL else min(int((t - STILL) / (self.seconds[0] + PAUSE)), len(self.order))

    def at(self, t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Positions, velocities and accelerations at a time [s], (nv,) each."""
        part, n = self.part(t), len(self.start)
        q, v, a = np.zeros(n), np.zeros(n), np.zeros(n)
        if 0 <= part < len(self.order):
            i = self.order[part]
            s = wave((t - self._begins(part)) / self.seconds[0], 1, self.seconds[0])
            q[i], v[i], a[i] = (self.alone[i] * x for x in s)
        elif part == len(self.order):
            x = (t - self._begins(part)) / self.seconds[1]
            for i in self.order:
                s = wave(x, int(self.waves[i]), self.seconds[1])
                q[i], v[i], a[i] = (self.together[i] * one for one in s)
        q, v, a = (self.ratio * one[self.lead] for one in (q, v, a))
        return self.start + q, v, a


def wave(x: float, k: int, seconds: float) -> tuple[float, float, float]:
    """sin^2(pi x) sin^2(k pi x) and its two derivatives by time; nothing outside 0 < x < 1.

    It is (1 - cos y - cos k y + cos((k - 1) y)/2 + cos((k + 1) y)/2)/4 with y = 2 pi x.
    """
    if not 0.0 < x < 1.0:
        return 0.0, 0.0, 0.0
    y, rate = 2.0 * np.pi * x, 2.0 * np.pi / seconds
    terms = ((-1.0, 1.0), (-1.0, k), (0.5, k - 1.0), (0.5, k + 1.0))
    s = 0.25 * (1.0 + sum(c * np.cos(m * y) for c, m in terms))
    v = -0.25 * rate * sum(c * m * np.sin(m * y) for c, m in terms)
    a = -0.25 * rate**2 * sum(c * m * m * np.cos(m * y) for c, m in terms)
    return float(s), float(v), float(a)


def steepest(k: FloatArray, seconds: float) -> tuple[FloatArray, FloatArray]:
    """What the derivatives of ``wave`` stay below, by its terms: (1 + 2 k)/4 and (1 + k^2)/2."""
    rate = 2.0 * np.pi / seconds
    return 0.25 * (1.0 + 2.0 * k) * rate, 0.5 * (1.0 + k * k) * rate**2


def first_motion(
    robot: Robot, q: FloatArray, working: BoolArray, seconds: float | None = None
) -> FirstMotion:
    """The motion of an arm from a posture; joints that do not work stand.

    Args:
        robot: The arm.
        q: Where it begins, (nv,) [rad or m].
        working: Which joints work, (nv,).
        seconds: About how long it takes [s]; None is 10 s, and more for more than seven joints.

    Raises:
        InputError: No joint can move, or the time is too short for each to move.
    """
    limits, chain = robot.limits, robot.chain
    up, down = limits.q_max - q, q - limits.q_min
    moves = working & (chain.lead == np.arange(robot.nv))
    room = ROOM * np.maximum(np.maximum(up, down), 0.0)
    order = tuple(int(i) for i in np.flatnonzero(moves & (room > 0.0)))
    if not order:
        raise InputError(
            f"no joint of {robot.name} can move from this posture: each has failed or has no range; say "
            "which works, planner.withdraw(joint), or begin elsewhere"
        )
    least = (len(order) * (QUICKEST + PAUSE)) / (1.0 - TOGETHER) + 2.0 * STILL
    if seconds is None:
        seconds = max(LONG, EASY * least)
    elif seconds < least:
        raise InputError(
            f"seconds is {seconds:g}, expected at least {least:.1f}: {len(order)} joints move one after the "
            "other, and then together"
        )
    rest = seconds - 2.0 * STILL
    own = (1.0 - TOGETHER) * rest / len(order) - PAUSE
    both = TOGETHER * rest - PAUSE
    reach = np.where(chain.prismatic, REACH[True], REACH[False])
    a_max = np.minimum(SHARE * limits.a_max, limits.v_max / GENTLE)
    first, last = WAVES
    waves = np.full(robot.nv, first)
    waves[list(order)] = first + np.arange(len(order)) % (last - first + 1)
    sizes = []
    for k, time in ((np.ones(robot.nv), own), (waves.astype(float), both)):
        v, a = steepest(k, time)
        size = np.minimum(np.minimum(reach, room), np.minimum(SHARE * limits.v_max / v, a_max / a))
        sizes.append(np.where(up >= down, size, -size))
    return FirstMotion(
        start=np.array(q), alone=sizes[0], together=sizes[1], waves=waves, order=order, seconds=(own, both),
        lead=np.array(chain.lead), ratio=np.array(chain.ratio),
    )  # fmt: skip
