"""An arm that reaches for points while its joints fail, with or without ftqp between policy and motors."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np

import ftqp

HEALTHY, LOCKED, FREE, WEAK = range(4)
"""What may be the matter with a joint."""
LAYERS = ("tip", "joints", "below")
DT = 0.004
"""Period of the planner and of the motors [s]."""
FASTEST = 0.25
"""How fast an action of 1 moves the end effector [m/s]."""
LEADS = {"tip": 0.1, "below": 0.02}
"""The target leads the end effector by so much at most in each layer that ftqp leads [m]."""
SHARE = 0.5
"""An action of 1 moves a joint at this share of its speed limit."""
REACHED = 0.01
"""So near is there [m]."""
SPREAD = 0.2
"""The first posture is so far from the neutral one at most [rad], and the point from the end effector [m]."""


@dataclass(frozen=True)
class Failures:
    """How joints fail.

    Args:
        share: The share of episodes with a failure, in [0, 1].
        kinds: One of these: ``LOCKED``, ``FREE``, ``WEAK``.
        after: So long after it the failure is told [s]; infinity: never.
        between: It begins between these times [s].
    """

    share: float = 0.5
    kinds: tuple[int, ...] = (LOCKED, WEAK)
    after: float = 0.0
    between: tuple[float, float] = (0.2, 2.0)

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ftqp.InputError(f"share is {self.share!r}, expected a share of episodes in [0, 1]")
        if not self.kinds or not set(self.kinds) <= {LOCKED, FREE, WEAK}:
            raise ftqp.InputError(f"kinds is {self.kinds!r}, expected some of LOCKED, FREE, WEAK (1, 2, 3)")
        if not 0.0 <= self.between[0] <= self.between[1] < np.inf or not self.after >= 0.0:
            raise ftqp.InputError(
                f"between is {self.between!r} and after {self.after!r}, expected times >= 0 in order"
            )


def fault_of(kind: int, joint: int) -> ftqp.Locked | ftqp.FreeSwinging | ftqp.Degraded:
    """A failure of a joint."""
    if kind == LOCKED:
        return ftqp.Locked(joint)
    return (
        ftqp.FreeSwinging(joint, damping=0.5)
        if kind == FREE
        else ftqp.Degraded(joint, velocity=0.3, torque=0.5)
    )


def ticks_of(period: float, seconds: float) -> tuple[int, int]:
    """Ticks of a step and of an episode."""
    ticks, last = round(period / DT), round(seconds / DT)
    if not (ticks >= 1 and last >= ticks):
        raise ftqp.InputError(
            f"period is {period!r} s and seconds {seconds!r}, expected 0.004 <= period <= seconds"
        )
    return ticks, last


def spaces_of(robot: ftqp.Robot, layer: str) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.Box]:
    """The spaces of what is seen and of actions."""
    n, limits = robot.nv, robot.limits
    edge = np.concatenate([4.0 * limits.v_max, np.full(3, 3.0)])
    low = np.concatenate([limits.q_min - 0.1, -edge, np.zeros(4 * n)])
    high = np.concatenate([limits.q_max + 0.1, edge, np.ones(4 * n)])
    seen = gymnasium.spaces.Box(low, high, dtype=np.float64)
    return seen, gymnasium.spaces.Box(-1.0, 1.0, (3 if layer == "tip" else n,), np.float32)


def drawn_episode(draw: np.random.Generator, robot: ftqp.Robot, how: Failures) -> tuple[Any, Any, Any]:
    """The first posture, the failure or None, and the way from the end effector to the point."""
    q = robot.neutral + draw.uniform(-SPREAD, SPREAD, robot.nv)
    failure = int(draw.integers(robot.nv)), int(draw.choice(how.kinds)), float(draw.uniform(*how.between))
    return q, failure if draw.random() < how.share else None, draw.uniform(-SPREAD, SPREAD, 3)


def given_failure(robot: ftqp.Robot, failure: Any) -> tuple[int, int, float] | None:
    """A failure given by hand."""
    if failure is None:
        return None
    try:
        joint, kind, when = failure
        joint, when = robot.joint(joint), float(when)
    except (TypeError, ValueError) as error:
        raise ftqp.InputError(f"failure is {failure!r}, expected (joint, kind, seconds): {error}") from error
    if kind not in (LOCKED, FREE, WEAK) or not 0.0 <= when < np.inf:
        raise ftqp.InputError(
            f"failure is {failure!r}, expected a kind of LOCKED, FREE, WEAK and seconds >= 0"
        )
    return joint, int(kind), when


class FaultyArm(gymnasium.Env):
    """An arm that reaches for a point while a joint fails.

    Args:
        robot: A name of the catalog, or an ``ftqp.Robot``; physics and free joints need its masses.
        layer: What an action says: ``tip``, ``joints`` or ``below``, see the README.
        failures: How joints fail.
        seconds: The length of an episode [s].
        period: The time of one step, a multiple of 4 ms [s].
        physics: Motors and masses in MuJoCo; False moves the arm exactly as it is sent.
        render_mode: None; there are no pictures.

    Raises:
        ftqp.InputError: An unknown layer, or times that are not positive.
    """

    metadata = {"render_modes": [], "render_fps": 50}  # noqa: RUF012  as Gymnasium has it

    def __init__(
        self, robot: Any = "panda", layer: str = "tip", failures: Failures | None = None,
        seconds: float = 4.0, period: float = 0.02, physics: bool = True, render_mode: str | None = None,
    ) -> None:  # fmt: skip
        if layer not in LAYERS:
            raise ftqp.InputError(f"layer is {layer!r}, expected one of {', '.join(LAYERS)}")
        self.ticks, self.last = ticks_of(period, seconds)
        self.render_mode, self.layer, self.failures = render_mode, layer, failures or Failures()
        self.robot = ftqp.robots.load(robot) if isinstance(robot, str) else robot
        if physics:
            servo = ftqp.JointServo(self.robot, "position")
            self.plant: ftqp.Plant = ftqp.MujocoPlant(self.robot, DT, servo, substeps=2)
        else:
            self.plant = ftqp.KinematicPlant(self.robot, DT)
        self.observation_space, self.action_space = spaces_of(self.robot, layer)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin anew.

        Args:
            seed: Of this episode and those after it; None goes on with the draws.
            options: ``{"failure": (joint, kind, seconds)}`` is a failure by hand, None in its place is none.
        """
        super().reset(seed=seed)
        n = self.robot.nv
        q, self.failure, way = drawn_episode(self.np_random, self.robot, self.failures)
        if "failure" in (options or {}):
            self.failure = given_failure(self.robot, (options or {})["failure"])
        self.plant.reset(q, np.zeros(n))
        # another planner: what the last one has learned of the arm would leak into this episode
        self.planner = ftqp.Planner(self.robot, dt=DT, emergency=None, task=ftqp.Task("position"))
        self.planner.reset(q)
        self.sent, self.tick, self.kind, self.told = (
            q.copy(),
            0,
            np.zeros(n, dtype=np.int64),
            np.zeros(n, dtype=np.int64),
        )
        self.leads, self.status = self.layer == "tip", ""
        self.at = self.robot.pose(q)[:3, 3]
        self.target, self.goal = self.at.copy(), self.at + way
        return self._seen(), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Move for one period as the action says, each number in [-1, 1].

        Returns:
            What is seen, reward, whether the point is reached, whether the time is over, and ``info``.
        """
        action = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        if self.leads:
            lead = LEADS[self.layer]
            self.target = self.at + np.clip(self.target + self._way(action) - self.at, -lead, lead)
        for _ in range(self.ticks):
            self._fail()
            self.plant.advance(self._led() if self.leads else self._sent(action))
            self.tick += 1
        self.at = self.robot.pose(self.plant.q)[:3, 3]
        info = self._info()
        reached = info["left"] < REACHED
        return self._seen(), 10.0 * reached - info["left"], reached, self.tick >= self.last, info

    def _way(self, action: Any) -> Any:
        """How far an action moves the end effector in a step [m]."""
        if self.layer == "tip":
            return action * FASTEST * DT * self.ticks
        v = action * SHARE * self.robot.limits.v_max
        return (self.robot.pose(self.plant.q + v * DT)[:3, 3] - self.at) * self.ticks

    def _led(self) -> Any:
        """The command of the planner, whose target goes as the action says."""
        command = self.planner.step(self.plant.q, None, ftqp.Target(position=self.target))
        self.status = command.status.name
        return command

    def _sent(self, action: Any) -> Any:
        """The command of a policy that moves the joints itself."""
        v, limits = action * SHARE * self.robot.limits.v_max, self.robot.limits
        self.sent = np.clip(self.sent + v * DT, limits.q_min, limits.q_max)
        return SimpleNamespace(q=self.sent, v=v, a=0.0 * v, tau=0.0 * v, brakes=np.zeros(v.size, dtype=bool))

    def _fail(self) -> None:
        """Let the joint fail, and tell of it."""
        if self.failure is None:
            return
        joint, kind, when = self.failure
        if self.tick == round(when / DT):
            self.plant.fail(fault_of(kind, joint))
            self.kind[joint] = kind
        if not self.told[joint] and self.kind[joint] and self.tick * DT >= when + self.failures.after:
            self.told[joint] = kind
            self.planner.report(fault_of(kind, joint))
            if self.layer == "below":
                self.leads = True
                self.planner.reset(self.plant.q, self.plant.v)
                self.target = self.robot.pose(self.plant.q)[:3, 3]

    def _believed(self) -> Any:
        """What is believed of each joint: what was told, or what the planner has found."""
        found = self.told.copy()
        kinds = {ftqp.Locked: LOCKED, ftqp.FreeSwinging: FREE, ftqp.Degraded: WEAK}
        for name, fault in self.planner.faults.items():
            found[self.robot.joint(name)] = kinds[type(fault)]
        return found

    def _seen(self) -> Any:
        q, space = self.plant.q, self.observation_space
        seen = np.concatenate([q, self.plant.v, self.goal - self.at, np.eye(4)[self._believed()].ravel()])
        return np.clip(seen, space.low, space.high)

    def _info(self) -> dict[str, Any]:
        left = float(np.linalg.norm(self.at - self.goal))
        return {"left": left, "failed": self.kind.copy(), "believed": self._believed(), "status": self.status}
