"""Many arms that reach for points while their joints fail: the environment of ``faulty_arm``, as a vector."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

import ftqp
from ftqp_gym.faulty_arm import (
    DT,
    FASTEST,
    FREE,
    LAYERS,
    LEADS,
    LOCKED,
    REACHED,
    SHARE,
    WEAK,
    Failures,
    drawn_episode,
    fault_of,
    given_failure,
    spaces_of,
    ticks_of,
)

BRAKE = 0.25
"""Deceleration of a brake that closes, as a share of the limit, as of ``ftqp.KinematicPlant``."""
AGREEMENT = 1e-9
"""A failed joint that does so nearly what it is sent does it exactly, as there [rad/s]."""
WEAK_SHARE = fault_of(WEAK, 0).velocity
NAMES = np.array([status.name for status in ftqp.StepStatus])


class FaultyArmVec(gymnasium.vector.VectorEnv):
    """Arms that do exactly what they are sent and can, on all cores: ``FaultyArm(physics=False)`` many times.

    Environment i of ``reset(seed=s)`` is ``FaultyArm`` with seed s + i.

    Args:
        num_envs: How many arms.
        robot: A name of the catalog, or an ``ftqp.Robot``.
        layer: What an action says: ``tip``, ``joints`` or ``below``, see the README.
        failures: How joints fail; of the kinds ``LOCKED`` and ``WEAK``.
        seconds: The length of an episode [s].
        period: The time of one step, a multiple of 4 ms [s].
        autoreset_mode: When an episode that is over begins anew: with the next step, in the same one, or by
            ``reset(options={"reset_mask": mask})``.
        threads: How many threads of the CPU; None is all cores.
        render_mode: None; there are no pictures.

    Raises:
        ftqp.InputError: An unknown layer, a free joint, or times or numbers that are not positive.
    """

    def __init__(
        self, num_envs: int = 1, robot: Any = "panda", layer: str = "tip", failures: Failures | None = None,
        seconds: float = 4.0, period: float = 0.02, autoreset_mode: Any = AutoresetMode.NEXT_STEP,
        threads: int | None = None, render_mode: str | None = None,
    ) -> None:  # fmt: skip
        if layer not in LAYERS:
            raise ftqp.InputError(f"layer is {layer!r}, expected one of {', '.join(LAYERS)}")
        self.failures = failures or Failures()
        if FREE in self.failures.kinds:
            raise ftqp.InputError(
                "no joint swings freely in FaultyArmVec; take LOCKED and WEAK, or FaultyArm"
            )
        self.ticks, self.last = ticks_of(period, seconds)
        self.mode = AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "render_fps": 50, "autoreset_mode": self.mode}
        self.render_mode, self.layer, self.num_envs = render_mode, layer, num_envs
        self.robot = ftqp.robots.load(robot) if isinstance(robot, str) else robot
        planner = ftqp.Planner(self.robot, dt=DT, emergency=None, task=ftqp.Task("position"))
        self.arms = ftqp.batch.Arms(planner, num_envs, threads=threads)
        self.single_observation_space, self.single_action_space = spaces_of(self.robot, layer)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        count, n = num_envs, self.robot.nv
        self.q, self.v, self.sent = (np.zeros((count, n)) for _ in range(3))
        self.at, self.goal, self.target = (np.zeros((count, 3)) for _ in range(3))
        self.kind, self.told = (np.zeros((count, n), dtype=np.int64) for _ in range(2))
        # Of the failure of each episode: the joint, what, and when; never where there is none
        self.joint, self.what = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
        self.when, self.tell_from = np.full(count, np.inf), np.full(count, np.inf)
        self.tick, self.leads, self.over = (
            np.zeros(count, dtype=np.int64),
            np.zeros(count, bool),
            np.zeros(count, bool),
        )
        self.fails, self.knows = np.zeros(count, bool), np.zeros(count, bool)
        self.draws: list[np.random.Generator] = []

    def reset(
        self, *, seed: int | list[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin anew.

        Args:
            seed: Of the first environment, each other one has one more; or one each. None goes on with the
                draws.
            options: ``{"failure": (joint, kind, seconds)}`` is a failure by hand for all that begin, None in
                its place is none; ``{"reset_mask": mask}`` says which begin, (num_envs,) truth values.
        """
        options = options or {}
        mask = np.asarray(options.get("reset_mask", np.ones(self.num_envs, dtype=bool)))
        if mask.shape != (self.num_envs,) or mask.dtype != bool:
            raise ftqp.InputError(
                f"reset_mask is {mask.dtype} of shape {mask.shape}, expected truth values, ({self.num_envs},)"
            )
        if seed is not None or not self.draws:
            seeds = [None] * self.num_envs if seed is None else seed
            seeds = [seed + i for i in range(self.num_envs)] if isinstance(seeds, int | np.integer) else seeds
            fresh = [seeding.np_random(one)[0] for one in seeds]
            again = self.draws or fresh
            self.draws = [new if meant else old for new, old, meant in zip(fresh, again, mask, strict=True)]
        self._begin(mask, options)
        return self._seen(), self._info()

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Move all arms for one period as the actions say, each number in [-1, 1].

        Returns:
            What is seen, rewards, whether points are reached, whether time is over, and ``info``.
        """
        actions = np.clip(np.asarray(actions, dtype=float), -1.0, 1.0)
        again = self.over.copy() if self.mode is AutoresetMode.NEXT_STEP else np.zeros(self.num_envs, bool)
        if again.any():
            self._begin(again, {})
        moves = ~again & ~self.over
        if moves.any():
            self._move(actions, moves)
        left = np.linalg.norm(self.at - self.goal, axis=1)
        reached = moves & (left < REACHED)
        late = moves & (self.tick >= self.last)
        reward = np.where(moves, 10.0 * reached - left, 0.0)
        self.over |= reached | late
        seen, info = self._seen(), self._info()
        if self.mode is AutoresetMode.SAME_STEP and self.over.any():
            done, final = self.over.copy(), info
            self._begin(done, {})
            info = {
                **self._info(),
                "final_obs": seen,
                "_final_obs": done,
                "final_info": final,
                "_final_info": done,
            }
            seen = self._seen()
        return seen, reward, reached, late, info

    def _begin(self, mask: Any, options: dict[str, Any]) -> None:
        """Begin the episodes that are meant."""
        by_hand = given_failure(self.robot, options["failure"]) if "failure" in options else None
        if by_hand is not None and by_hand[1] == FREE:
            raise ftqp.InputError(
                "no joint swings freely in FaultyArmVec; take LOCKED and WEAK, or FaultyArm"
            )
        for i in np.flatnonzero(mask):
            q, failure, self.goal[i] = drawn_episode(self.draws[i], self.robot, self.failures)
            failure = by_hand if "failure" in options else failure
            self.q[i] = q
            self.joint[i], self.what[i], when = failure or (0, 0, np.inf)
            self.when[i] = round(when / DT) if when < np.inf else np.inf
            self.tell_from[i] = when + self.failures.after
        self.v[mask], self.tick[mask], self.over[mask] = 0.0, 0, False
        self.kind[mask], self.told[mask], self.leads[mask] = 0, 0, self.layer == "tip"
        self.sent[mask] = self.q[mask]
        self.fails[mask] = self.knows[mask] = False
        self.arms.reset(mask, self.q)
        at = self.arms.poses(self.q)[mask, :3, 3]
        self.at[mask], self.target[mask] = at, at
        self.goal[mask] += at

    def _move(self, actions: Any, moves: Any) -> None:
        """One period of the arms that are meant."""
        v = actions * SHARE * self.robot.limits.v_max if self.layer != "tip" else None
        if self.layer == "tip":
            way = actions * FASTEST * DT * self.ticks
        elif self.layer == "below":
            way = (self.arms.poses(self.q + v * DT)[:, :3, 3] - self.at) * self.ticks
        else:
            way = np.zeros(3)
        most = LEADS.get(self.layer, 0.0)
        lead = np.clip(self.target + way - self.at, -most, most)
        np.copyto(self.target, self.at + lead, where=(moves & self.leads)[:, None])
        low, high = self.robot.limits.q_min, self.robot.limits.q_max
        for _ in range(self.ticks):
            self._fail(moves)
            led = moves & self.leads
            if v is not None:
                np.copyto(self.sent, np.clip(self.sent + v * DT, low, high), where=moves[:, None])
            to, at_speed = self.sent, v
            if led.any():
                self.arms.q[:], self.arms.v[:] = self.q, 0.0
                self.arms.step(self.target, mask=led)
                whole = led.all()
                to = self.arms.q_sent if whole else np.where(led[:, None], self.arms.q_sent, self.sent)
                at_speed = (
                    self.arms.v_sent if whole or v is None else np.where(led[:, None], self.arms.v_sent, v)
                )
            self._follow(to, at_speed, moves)
            self.tick += moves
        np.copyto(self.at, self.arms.poses(self.q)[:, :3, 3], where=moves[:, None])

    def _fail(self, moves: Any) -> None:
        """Let joints fail, and tell of them."""
        begins = moves & (self.tick == self.when)
        self.kind[begins, self.joint[begins]] = self.what[begins]
        self.fails |= begins
        tells = moves & self.fails & ~self.knows & (self.tick * DT >= self.tell_from)
        if not tells.any():
            return
        self.knows |= tells
        self.told[tells] = self.kind[tells]
        if self.layer == "below":
            self.leads |= tells
            self.arms.reset(tells, self.q, self.v)
            np.copyto(self.target, self.arms.poses(self.q)[:, :3, 3], where=tells[:, None])
        for joint, kind in set(zip(self.joint[tells].tolist(), self.what[tells].tolist(), strict=True)):
            self.arms.report(tells & (self.joint == joint) & (self.what == kind), fault_of(kind, joint))

    def _follow(self, q: Any, v: Any, moves: Any) -> None:
        """A tick of arms that do what they are sent, but for a failed joint; as ``ftqp.KinematicPlant``."""
        failed = np.flatnonzero(moves & self.fails)
        j = self.joint[failed]
        q0, v0 = self.q[failed, j], self.v[failed, j]
        np.copyto(self.q, q, where=moves[:, None])
        np.copyto(self.v, v, where=moves[:, None])
        still = (v0 == 0.0) & (self.what[failed] == LOCKED)
        self.q[failed[still], j[still]], self.v[failed[still], j[still]] = q0[still], 0.0
        if still.all():
            return
        failed, j, q0, v0 = failed[~still], j[~still], q0[~still], v0[~still]
        limits, asked, to = self.robot.limits, self.v[failed, j], self.q[failed, j]
        room = np.where(v0 > 0.0, limits.q_max[j] - q0, q0 - limits.q_min[j])
        way = 2.0 * room - np.abs(v0) * DT
        needed = np.where(way > 0.0, v0 * v0 / np.where(way > 0.0, way, 1.0), np.inf)
        brake = np.maximum(BRAKE * limits.a_max[j], np.minimum(needed, limits.a_max[j])) * DT
        braked = np.where(np.abs(v0) <= brake, 0.0, v0 - np.sign(v0) * brake)
        step = limits.a_max[j] * DT
        top = np.maximum(WEAK_SHARE * limits.v_max[j], np.abs(v0) - step)
        weak = np.minimum(np.maximum(asked, np.maximum(v0 - step, -top)), np.minimum(v0 + step, top))
        weak = np.where(np.abs(weak - asked) <= 1e-12 * (1.0 + np.abs(asked)), asked, weak)
        after = np.where(self.what[failed] == LOCKED, braked, weak)
        there = q0 + DT * 0.5 * (v0 + after)
        obeys = (np.abs(after - asked) <= AGREEMENT) & (np.abs(there - to) <= AGREEMENT)
        stands = (v0 == 0.0) & (after == 0.0)
        self.q[failed, j] = np.where(stands, q0, np.where(obeys, to, there))
        self.v[failed, j] = np.where(~stands & obeys & (after != 0.0), asked, after)

    def _believed(self) -> Any:
        """What is believed of each joint: what was told, or what the arms have found."""
        return np.choose(self.arms.found, (self.told, LOCKED, FREE))

    def _seen(self) -> Any:
        space = self.single_observation_space
        one_hot = np.eye(4)[self._believed()].reshape(self.num_envs, -1)
        seen = np.concatenate([self.q, self.v, self.goal - self.at, one_hot], axis=1)
        return np.clip(seen, space.low, space.high)

    def _info(self) -> dict[str, Any]:
        status = np.where(self.leads & (self.tick > 0), NAMES[self.arms.status], "")
        info: dict[str, Any] = {
            "left": np.linalg.norm(self.at - self.goal, axis=1),
            "failed": self.kind.copy(),
            "believed": self._believed(),
            "status": status,
        }
        every = np.ones(self.num_envs, dtype=bool)
        return {**info, **{f"_{name}": every for name in info}}
