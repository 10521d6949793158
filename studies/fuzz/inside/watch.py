"""What leaves a planner is held, after every step, against the model, the last command and what was told.

Nothing here asks the kernel what a limit is: limits are those of the model and the shares of what was
reported. The record is read for two questions only: whether it says the same as ``planner.faults``, and
whether the arm is held, which other statuses hide.
"""

from typing import Any, final

import numpy as np

import ftqp
from ftqp.kernel.layout.enums import BRAKING, FREE, HEALTHY, INSTANT, LOCKED, MEASURED

Array = np.ndarray[Any, Any]
ROUNDING = 1e-8
"""A position, a speed or a torque may be so much beyond its limit: this, and this share of it."""
KIND = np.full(8, -1)
KIND[[HEALTHY, BRAKING, LOCKED, INSTANT, FREE, MEASURED]] = 0, 1, 1, 1, 2, 2
"""What each code of a joint is to a user: it works, it is held, it swings."""
LIMITS = ("q_min", "q_max", "v_max", "a_max", "tau_max")
BEYOND = ("the position that is sent is beyond the range", "the position that is sent jumps",
          "the speed is beyond its limit", "the reference jumps", "the acceleration is beyond its limit",
          "what is sent is beyond the drive's limit")  # fmt: skip
WORST = 4
"""So many sentences of an episode are kept of each kind."""


@final
class Watch:
    """Who looks at the steps of one planner.

    Attributes:
        beyond: How many commands were beyond limits.
        infinite: How many were not finite.
        disagreements: After how many steps belief and kernel disagreed.
        wrong: The first of them in words.
        told: What is believed, by joint name, as of the last step.
        q: Where the reference is, (nv,) [rad or m].
        v: Its velocity, (nv,).
    """

    def __init__(self, planner: Any, drive: str, viable: bool) -> None:
        robot, session = planner.robot, planner._session
        n = self._n = robot.nv
        self.planner, self._drive, self._viable = planner, drive, viable
        self.beyond = self.infinite = self.disagreements = 0
        self.wrong: list[str] = []
        self._healthy = {name: getattr(robot.limits, name).copy() for name in LIMITS}
        self._code = session.view("faults", "code")[:n]
        self._order, self._working = session.view("faults", "order"), session.view("faults", "working")
        self._limits = [session.view("limits", name)[:n] for name in LIMITS]
        self._held = session.view("held", "on")
        self._has_inertia, self._dt = robot.has_inertia, planner.dt
        self._lead = float(session.K.gate.lead)
        self._floats = robot.chain.floating
        self._low = self._healthy["q_min"] - ROUNDING
        self._high = self._healthy["q_max"] + ROUNDING
        self._block = np.zeros((6, n))
        self._v_sent, self._was_held = np.zeros(n), False
        self._over = np.zeros((6, n))
        self.told: dict[str, Any] | None = None
        self._of_torques = 0
        self._believe({})
        self.begin(robot.neutral, np.zeros(n))

    def begin(self, q: Array, v: Array) -> None:
        """The planner was told to begin at (q, v)."""
        self.q, self.v = np.array(q, dtype=float), np.array(v, dtype=float)
        self._sent, self._tick = self.q + self._lead * self.v, -1
        self._was_locked = self._was_free = self._was_failed = np.zeros(self._n, dtype=bool)
        self._late, self._speed = np.zeros(self._n), np.zeros(self._n)
        self._jumped, self._a_was = False, self._a_max

    def jump(self) -> None:
        """A lock that happens at once was told: the next tick may change the other joints' velocities."""
        self._jumped = True

    def failed_unseen(self, joint: int) -> None:
        """A joint had failed in ticks that nobody has seen: it begins to work from where it then was."""
        self._was_failed = self._was_failed.copy()
        self._was_failed[joint] = True

    def _believe(self, told: dict[str, Any]) -> None:
        """What kinds, limits and lists of joints follow from what was told."""
        if told == self.told:
            return
        robot, n = self.planner.robot, self._n
        self.told, self._kinds = dict(told), np.zeros(n, dtype=np.int64)
        limits = {name: value.copy() for name, value in self._healthy.items()}
        for joint, fault in told.items():
            i = robot.joint(joint)
            if isinstance(fault, ftqp.Degraded):
                for name, share in fault.shares.items():
                    limits[name][i] *= getattr(fault, share)
                limits["q_min"][i] = max(limits["q_min"][i], -np.inf if fault.q_min is None else fault.q_min)
                limits["q_max"][i] = min(limits["q_max"][i], np.inf if fault.q_max is None else fault.q_max)
            else:
                self._kinds[i] = 2 if isinstance(fault, ftqp.FreeSwinging) else 1
        self._expected = [limits[name].tobytes() for name in LIMITS]
        self._a_max, self._tau_max = limits["a_max"], limits["tau_max"]
        self._drives = np.flatnonzero(self._kinds == 0)
        self._all_work = len(self._drives) == n

    def look(self, step: Any, speed: Array) -> bool:
        """Judge a step that the planner has just made: whether nothing was wrong.

        Args:
            step: The step.
            speed: How fast the joints really were when it was made, (nv,) [rad/s or m/s]: what has failed may
                be faster than its limit, and what has been mended is not inside its range at once.
        """
        planner, block = self.planner, self._block
        self._speed = np.abs(speed)
        before = self.beyond + self.infinite + self.disagreements
        reference, tick = step.reference, planner.tick
        parts = (step.q, step.v, step.a, reference.q, reference.v)
        if any(part.shape != (self._n,) or part.dtype != np.float64 for part in parts):
            self._say("disagreements", tick, f"a step has other arrays: {[part.shape for part in parts]}")
            return False
        for row, part in enumerate(parts):
            block[row] = part
        self._of_torques += 1
        by_torque = self._drive == "torque"
        block[5] = step.tau if by_torque or (self._has_inertia and self._of_torques % 16 == 0) else 0.0
        self._judge(planner, tick, step.status.name)
        self._agree(planner, tick)
        self._sent, self.q, self.v = block[0].copy(), block[3].copy(), block[4].copy()
        self._v_sent, self._was_held = block[1].copy(), bool(self._held[0])
        self._tick, self._jumped = tick, False
        self._was_failed, self._was_free = self._kinds != 0, self._kinds == 2
        self._was_locked, self._a_was = self._code == LOCKED, self._a_max
        return self.beyond + self.infinite + self.disagreements == before

    def _judge(self, planner: Any, tick: int, status: str) -> None:
        """Finite, in range, and near what left last."""
        block, over, dt = self._block, self._over, self._dt
        if not np.isfinite(block).all():
            name = ("q", "v", "a", "reference.q", "reference.v", "tau")[
                int(np.argmin(np.isfinite(block).all(1)))
            ]
            self._say("infinite", tick, f"{name} is not finite ({status})")
            return
        self._believe(planner.faults)
        sent, v, q, v_max = block[0], np.abs(block[4]), block[3], self._healthy["v_max"]
        passed = max(1, tick - self._tick)
        time, last = passed * dt, np.abs(self.v)
        top = np.maximum(v, last)
        most = np.maximum(np.maximum(v_max, last), v if passed > 1 else self._speed)
        over[0] = np.maximum(self._low - sent, sent - self._high)
        self._excuse(over[0], time)
        over[1] = _over(sent - self._sent, time * most + passed * self._lead * dt * self._healthy["a_max"])
        if self._drive != "position":  # of a mended joint that is the reference again once the gate is open
            over[1, (self._was_failed | (self._sent != self.q)) & (self._kinds == 0)] = -1.0
        over[2] = _over(v, np.maximum(v_max, last))
        over[3] = _over(q - self.q, time * (most if self._jumped or passed > 1 else top))
        over[3, : self._floats] = -1.0  # momentum bends a base's way within a tick, as other tests hold
        a_max = self._a_max if passed == 1 else np.maximum(self._a_max, self._a_was)
        over[4] = _over(block[4] - self.v, time * a_max)
        if self._drive == "torque":
            over[5] = _over(block[5], self._tau_max)
        elif self._drive == "velocity":
            over[5] = _over(block[1], np.maximum(v_max, v))
        if self._held[0] or self._was_held:  # its reference rests at once where it is sent
            over[3:5] = -1.0
        if not self._viable or self._jumped:
            over[4] = -1.0
            if self._lead > 0.0:  # what is sent ahead changes with the speed, which is free to jump there
                over[1] = -1.0
        if (over <= 0.0).all():
            return
        failed = (self._kinds != 0) | self._was_failed
        over[:2, (self._kinds == 2) | self._was_free] = -1.0  # of a joint that swings its place is said
        over[2:, failed] = -1.0
        if (over <= 0.0).all():
            return
        row = int(np.argmax((over > 0.0).any(axis=1)))
        joint = int(np.argmax(over[row]))
        by = over[row, joint]
        self._say("beyond", tick, f"joint {joint}: {BEYOND[row]} by {by:.3g} ({status})")

    def _excuse(self, over: Array, time: float) -> None:
        """A fast joint that is mended, or whose acceleration limit falls, cannot brake in its range."""
        mended = (self._was_failed | (self._a_max < self._a_was)) & (self._kinds == 0)
        if mended.any():
            room = self._speed**2 / (2.0 * self._a_max) + self._speed * time
            self._late = np.where(mended, np.maximum(room, self._late), self._late)
        if self._late.any():
            self._late[(over <= 0.0) & (np.abs(self._block[4]) == 0.0)] = 0.0
            over -= self._late

    def _agree(self, planner: Any, tick: int) -> None:
        """The kernel holds for failed what the planner says, with what limits are left, and drives others."""
        self._believe(planner.faults)
        code = self._code
        if not np.array_equal(KIND[code], self._kinds):
            self._say("disagreements", tick, f"codes {code.tolist()}, told {self.told}")
        elif [room.tobytes() for room in self._limits] != self._expected:
            wrong = [name for name, room, expected in zip(LIMITS, self._limits, self._expected, strict=True)
                     if room.tobytes() != expected]  # fmt: skip
            self._say("disagreements", tick, f"limits {wrong}, told {self.told}")
        elif int(self._working[0]) != len(self._drives):
            self._say("disagreements", tick, f"{int(self._working[0])} joints work, told {self.told}")
        elif not self._all_work:
            if not np.array_equal(self._order[: len(self._drives)], self._drives):
                self._say("disagreements", tick, f"joints {self._order.tolist()} work, told {self.told}")
            held = self._was_locked & (code == LOCKED)
            faster = np.abs(self._block[1]) > np.abs(self._v_sent)  # what was sent ahead may brake, no more
            if self._block[4, held].any() or faster[held].any():
                self._say("disagreements", tick, "a locked joint is told to move")

    def say_disagreement(self, sentence: str) -> None:
        """Count something else that planner and kernel, or user, see differently."""
        self._say("disagreements", self._tick, sentence)

    def _say(self, kind: str, tick: int, sentence: str) -> None:
        setattr(self, kind, getattr(self, kind) + 1)
        if sum(kind in said for said in self.wrong) < WORST:
            self.wrong.append(f"{kind}: tick {tick}: {sentence:.300}")


def _over(value: Array, most: Array) -> Array:
    """How far |value| is beyond ``most``, rounding aside."""
    return np.abs(value) - most * (1.0 + ROUNDING) - ROUNDING
