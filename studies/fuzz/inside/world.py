"""An episode from inside while it runs: the planner, its arm that does what it is told, and who watches."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

import ftqp
from ftqp.core.errors import InputError
from fuzz.inside.planners import Made
from fuzz.inside.watch import Watch

Array = np.ndarray[Any, Any]
FASTEST = 15.0
"""A joint that swings is never faster [rad/s or m/s]."""
MOST_FAULTS = 3


class Disturbed(Exception):
    """What an episode raises inside a planner; no code of ftqp raises or catches it."""


class Stopped(KeyboardInterrupt):
    """The same, as Ctrl-C comes."""


@final
@dataclass(slots=True, kw_only=True)
class World:
    """An episode as it runs.

    Attributes:
        made: Its planner and arm.
        rng: Draws everything.
        watch: Judges its steps.
        target: What it is given to follow; the episode's own, which may be spoilt.
        base: The pose around which the target moves, (4, 4).
        arm: Where the joints really are, and how fast, (nv,) each.
        step: The last step.
        told: What was reported of each joint and not withdrawn, by joint name.
        steps: How many were made.
        done: How often each generator was used.
        lines: How many lines each call has taken at most.
        places: Lines of ftqp at which an exception was raised.
    """

    made: Made
    rng: np.random.Generator
    watch: Watch
    target: Any
    base: Array
    arm: tuple[Array, Array]
    step: Any = None
    told: dict[str, Any] = field(default_factory=dict)
    steps: int = 0
    done: dict[str, int] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    places: set[str] = field(default_factory=set)

    @property
    def planner(self) -> Any:
        """The planner that is disturbed."""
        return self.made.planner

    def move_target(self, k: int) -> None:
        """The target as it is at a tick."""
        T = self.base.copy()
        T[:3, 3] += 0.05 * np.sin(1.5 * k * self.planner.dt) * np.array([1.0, -0.6, 0.4])
        if self.target.packed[-1] != 1.0:  # it was made none
            self.target = ftqp.Target(pose=T)
        self.target.at(T)

    def make(self) -> Any:
        """The step that the arm would make; a target that was made none is refused, and another one taken."""
        try:
            return self.planner.step(self.arm[0], None, self.target)
        except InputError as error:
            if self.target.packed[-1] == 1.0 or "target" not in str(error):
                raise
            self.target = ftqp.Target(pose=self.base)
        return self.planner.step(self.arm[0], None, self.target)

    def take(self, step: Any) -> None:
        """Let the arm do what a step says, and judge it."""
        self.steps += 1
        self.step = step
        if not self.watch.look(step, self.arm[1]):
            return
        self._agreed()
        self.obey()

    def _agreed(self) -> None:
        told = self.watch.told
        if self.made.watched:
            self.told = dict(told or {})
        elif told != self.told:
            self.watch.say_disagreement(f"the planner believes {told}, told {self.told}")
            self.told = dict(told or {})

    def obey(self) -> None:
        """The arm does what it is told; a joint that swings falls between its end stops."""
        watch = self.watch
        if not self.told:
            self.arm = watch.q, watch.v
            return
        robot, dt, a = self.made.robot, self.planner.dt, self.step.a
        q, v = watch.q.copy(), watch.v.copy()
        for joint, fault in self.told.items():
            i = robot.joint(joint)
            if isinstance(fault, ftqp.FreeSwinging):
                v[i] = np.clip(self.arm[1][i] + dt * a[i], -FASTEST, FASTEST)
                q[i] = np.clip(self.arm[0][i] + dt * v[i], robot.limits.q_min[i], robot.limits.q_max[i])
                if not robot.limits.q_min[i] < q[i] < robot.limits.q_max[i]:
                    v[i] = 0.0
            elif isinstance(fault, ftqp.Locked) and v[i] == 0.0:
                q[i] = self.arm[0][i]
        self.arm = q, v

    def begin(self, q: Array, v: Array | None) -> None:
        """The planner was told to begin somewhere: the arm is there."""
        self.arm = q.copy(), np.zeros(len(q)) if v is None else v.copy()
        self.watch.begin(*self.arm)

    def drawn_call(self) -> "Told":
        """A call that tells the planner something, and what then is to be true."""
        rng, robot, planner = self.rng, self.made.robot, self.planner
        kind = ("report", "report", "report", "withdraw", "withdraw", "reset", "carry", "tool", "resume",
                "stop", "speed")[int(rng.integers(11))]  # fmt: skip
        if kind == "report" and len(self.told) >= MOST_FAULTS:
            kind = "withdraw"
        if kind == "report":
            fault = self.drawn_fault()
            name = robot.joints[robot.joint(fault.joint)]
            told = {**self.told, name: fault}
            return Told("report", lambda: planner.report(fault), told, joints=frozenset({name}))
        if kind == "withdraw":
            names = list(self.told) or list(robot.joints)
            name = names[int(rng.integers(len(names)))]
            left = {joint: fault for joint, fault in self.told.items() if joint != name}
            return Told("withdraw", lambda: planner.withdraw(name), left, joints=frozenset({name}))
        if kind == "reset":
            q, v = self.drawn_start()
            return Told("reset", lambda: planner.reset(q, v), self.told, start=(q, v))
        if kind == "carry" and robot.has_inertia:
            mass, place = float(10.0 ** rng.uniform(-2.0, 0.5)), rng.normal(0.0, 0.05, 3)
            load = ftqp.Payload(mass, tuple(place)) if rng.random() < 0.7 else None
            return Told("carry", lambda: planner.carry(load), self.told)
        if kind == "tool":
            T = np.eye(4)
            T[:3, 3] = rng.normal(0.0, 0.05, 3)
            return Told("tool", lambda: planner.tool(T), self.told)
        if kind == "stop":
            return Told("stop", planner.stop, self.told)
        if kind == "speed":
            share = float(rng.uniform(0.1, 1.0))
            return Told("speed", lambda: setattr(planner, "speed", share), self.told)
        return Told("resume", planner.resume, self.told)

    def drawn_fault(self, joint: int | None = None) -> Any:
        """A fault of any kind.

        Args:
            joint: Of which joint; None is any.
        """
        rng, robot = self.rng, self.made.robot
        i = int(rng.integers(robot.chain.floating, robot.nv)) if joint is None else joint
        name = i if rng.random() < 0.5 else robot.joints[i]
        kind = int(rng.integers(5))
        if kind == 0:
            return ftqp.Locked(name)
        if kind == 1:
            reset = ("kinematic", "momentum", "task")[int(rng.integers(3 if robot.has_inertia else 1))]
            self.watch.jump()
            return ftqp.Locked(name, mode="instant", reset=reset)
        if kind == 2 and robot.has_inertia and robot.is_serial and not robot.chain.floating:
            return ftqp.FreeSwinging(name, damping=float(rng.uniform(0.0, 5.0)))
        if kind == 3:
            return ftqp.Locked(name, deceleration=float(10.0 ** rng.uniform(-3.0, 6.0)))
        velocity, acceleration, torque = rng.uniform([0.05, 0.05, 0.6], 1.0).tolist()
        return ftqp.Degraded(name, velocity, acceleration, torque)

    def drawn_start(self) -> tuple[Array, Array | None]:
        """Somewhere inside the range, from where every joint can brake."""
        rng, limits = self.rng, self.made.robot.limits
        low, high = limits.q_min, limits.q_max
        spread = np.where(np.isfinite(high - low), high - low, 2.0)
        middle = self.arm[0] if rng.random() < 0.7 else self.made.robot.neutral
        q = middle + (rng.uniform(-0.01, 0.01, len(low)) * spread if rng.random() < 0.5 else 0.0)
        return np.clip(q, low, high), None


@final
@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """A call that tells the planner something.

    Attributes:
        name: Its name.
        call: Makes it, as often as one likes.
        told: What is believed then, by joint name.
        start: Where the planner then begins, (q, v); None is where it is.
        joints: The names of the joints that it tells of.
    """

    name: str
    call: Callable[[], Any]
    told: dict[str, Any]
    start: tuple[Array, Array | None] | None = None
    joints: frozenset[str] = frozenset()

    def happened(self, world: World) -> None:
        """Note that it was made as a whole."""
        world.told = dict(self.told)
        if self.start is not None:
            world.begin(*self.start)
