"""What a fuzzed episode leaves to its judge: inputs, commands, claims and beliefs, tick by tick."""

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

Array = np.ndarray[Any, Any]


@final
class Account:
    """Arrays of a whole episode; ``count`` ticks of them are written.

    Attributes:
        count: How many ticks were done.
        q_before: Where the planner was commanded to be before each tick, (K, nv) [rad or m].
        v_before: How fast, (K, nv) [rad/s or m/s].
        q: Where it is commanded to be after it, (K, nv).
        v: How fast, (K, nv).
        a: The accelerations of the commands, (K, nv) [rad/s2 or m/s2].
        sent_q: Positions that are sent, (K, nv).
        sent_v: Velocities that are sent, (K, nv).
        given_q: The positions that were handed in, (K, nv).
        target: The poses that were handed in, (K, 4, 4).
        sound: Whether everything that was handed in was finite and the target a pose, (K,).
        has_tip: Whether a measured tip was handed in, (K,).
        asked: Whether a stop was asked for and not released, (K,).
        status: What was claimed of each tick.
        epochs: When a belief began, and what was believed, in order.
    """

    def __init__(self, ticks: int, joints: int) -> None:
        shape = (ticks, joints)
        self.count = 0
        self.q_before, self.v_before = np.empty(shape), np.empty(shape)
        self.q, self.v, self.a = np.empty(shape), np.empty(shape), np.empty(shape)
        self.sent_q, self.sent_v, self.given_q = np.empty(shape), np.empty(shape), np.empty(shape)
        self.target = np.empty((ticks, 4, 4))
        self.sound = np.zeros(ticks, dtype=bool)
        self.has_tip = np.zeros(ticks, dtype=bool)
        self.asked = np.zeros(ticks, dtype=bool)
        self.status: list[str] = []
        self.epochs: list[Epoch] = []


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Epoch:
    """Ticks with one belief, without a reset between them.

    Attributes:
        first: Its first tick.
        told: What was reported of each joint, by index.
        fresh: The joints of which that was new.
        healed: The joints that had failed until then, and work again.
        again: Whether it begins with a reset.
    """

    first: int
    told: dict[int, Any] = field(default_factory=dict)
    fresh: frozenset[int] = frozenset()
    healed: frozenset[int] = frozenset()
    again: bool = False
