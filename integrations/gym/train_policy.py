"""A policy trained on healthy arms, evaluated with a locked joint: alone, and with ftqp below it.

    pip install stable-baselines3
    python train_policy.py            trains and prints the table of the README; some minutes on one core
    python train_policy.py --quick    a tenth of the steps

PPO of stable-baselines3, with its own defaults for networks, trains two policies of the layer ``joints`` on
``FaultyArmVec``: one on healthy arms, which does not see what is believed of joints, and one with a lock in
every second episode, of which it is told.
"""

import argparse
from typing import Any

import ftqp_gym
import gymnasium
import numpy as np
import stable_baselines3
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

SECONDS, WHEN = 4.0, 0.2
"""Of an episode [s]; when a joint locks [s]."""
STEPS, ARMS = 1_000_000, 64
JUDGED = 200
"""Episodes of each cell of the table, which no training has seen."""


class Arms(VecEnv):
    """``FaultyArmVec`` as stable-baselines3 asks for it."""

    def __init__(self, failures: ftqp_gym.Failures, told: bool) -> None:
        self.arms = ftqp_gym.FaultyArmVec(
            ARMS, layer="joints", failures=failures, seconds=SECONDS, autoreset_mode="SameStep"
        )
        self.render_mode = None
        space = self.arms.single_observation_space
        self.sees = slice(None if told else 2 * self.arms.robot.nv + 3)
        space = gymnasium.spaces.Box(space.low[self.sees], space.high[self.sees], dtype=np.float32)
        super().__init__(ARMS, space, self.arms.single_action_space)

    def reset(self) -> Any:
        """What is seen at the start of episodes that a fixed seed draws."""
        return self.arms.reset(seed=1)[0][:, self.sees]

    def step_async(self, actions: Any) -> None:
        """Keep the actions."""
        self.actions = actions

    def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
        """Move all arms; those that are over have begun anew."""
        seen, reward, reached, late, info = self.arms.step(self.actions)
        over = reached | late
        infos = [
            {"terminal_observation": info["final_obs"][i, self.sees], "TimeLimit.truncated": not reached[i]}
            if over[i]
            else {}
            for i in range(self.num_envs)
        ]
        return seen[:, self.sees], reward, over, infos

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The same for every arm."""
        return [getattr(self, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """The same for every arm."""
        setattr(self, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """There is one environment."""
        return [getattr(self.arms, method_name)(*args, **kwargs)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """No arm is wrapped by itself."""
        return [False] * self.num_envs


def trained(failures: ftqp_gym.Failures, told: bool, steps: int) -> tuple[PPO, VecNormalize]:
    """A policy, and how it sees."""
    envs = VecNormalize(Arms(failures, told), gamma=0.98)
    policy = PPO("MlpPolicy", envs, n_steps=128, batch_size=1024, gamma=0.98, seed=1, device="cpu")
    return policy.learn(steps), envs


def judged(layer: str, policy: PPO, sees: VecNormalize, joint: int | None) -> str:
    """How many arrive, and what of the way is left where nine of ten end."""
    env = ftqp_gym.FaultyArmVec(JUDGED, layer=layer, seconds=SECONDS, autoreset_mode="Disabled")
    failure = None if joint is None else (joint, ftqp_gym.LOCKED, WHEN)
    seen, info = env.reset(seed=2_000_000, options={"failure": failure})
    size = sees.observation_space.shape[0]
    over, arrived = np.zeros(JUDGED, dtype=bool), np.zeros(JUDGED, dtype=bool)
    while not over.all():
        actions, _ = policy.predict(sees.normalize_obs(seen[:, :size]), deterministic=True)
        seen, _, reached, late, info = env.step(actions)
        arrived |= reached
        over |= reached | late
    return f"{arrived.mean():.0%}, {1e3 * np.quantile(info['left'], 0.9):.1f}"


def main() -> None:
    """Train, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true")
    steps = STEPS // 10 if parser.parse_args().quick else STEPS
    torch.set_num_threads(1)
    healthy = trained(ftqp_gym.Failures(share=0.0), False, steps)
    locks = ftqp_gym.Failures(share=0.5, kinds=(ftqp_gym.LOCKED,), between=(0.2, 1.0))
    informed = trained(locks, True, steps)
    print(f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}, {steps} steps\n")
    print("| joint that locks | trained healthy | the same with ftqp below it | trained with locks |")
    print("|---|---|---|---|")
    for joint in (None, *range(7)):
        columns = (("joints", *healthy), ("below", *healthy), ("joints", *informed))
        cells = " | ".join(judged(*column, joint) for column in columns)
        print(f"| {'none' if joint is None else joint + 1} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
