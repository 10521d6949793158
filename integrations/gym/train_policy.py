"""A policy trained on healthy arms, evaluated with a locked joint: alone, and with ftqp below it.

    pip install cma
    python train_policy.py            trains and prints the table of the README; some minutes on one core
    python train_policy.py --quick    a tenth of the generations

CMA-ES (`cma`) trains two policies of the layer ``joints`` on ``FaultyArmVec``: one on healthy arms, one with
a lock in every second episode, of which it is told. A policy is tanh(W f): f are the way to the point, its
products with the joint values, and for the second one its products with which joints are locked.
"""

import argparse
from time import perf_counter

import cma
import ftqp_gym
import numpy as np

SECONDS, SLOWS, WHEN = 4.0, 0.05, 0.2
"""Of an episode [s]; so near the point the way counts in full [m]; when a joint locks [s]."""
EPISODES, GENERATIONS, SIGMA = 32, 100, 0.3
JUDGED = 200
"""Episodes of each row of the table, which no training has seen."""


def features(seen: np.ndarray, env: ftqp_gym.FaultyArmVec, informed: bool) -> np.ndarray:
    """What the policy is a function of, (n, features)."""
    n = env.robot.nv
    way = np.clip(seen[:, 2 * n : 2 * n + 3] / SLOWS, -1.0, 1.0)
    beside = [np.ones((len(seen), 1)), seen[:, :n] - env.robot.neutral]
    if informed:
        beside.append(seen[:, 2 * n + 3 :].reshape(len(seen), n, 4)[:, :, ftqp_gym.LOCKED])
    return (np.concatenate(beside, axis=1)[:, :, None] * way[:, None, :]).reshape(len(seen), -1)


def rollout(
    env: ftqp_gym.FaultyArmVec,
    weights: np.ndarray,
    informed: bool,
    seeds: list[int],
    options: dict | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Sum of rewards, and what is left at the end [m]; the weights are of each arm, (n, nv, features)."""
    seen, info = env.reset(seed=seeds, options=options)
    total, over = np.zeros(env.num_envs), np.zeros(env.num_envs, dtype=bool)
    while not over.all():
        actions = np.tanh(np.einsum("eaf,ef->ea", weights, features(seen, env, informed)))
        seen, reward, reached, late, info = env.step(actions)
        total += reward
        over |= reached | late
    return total, info["left"]


def trained(failures: ftqp_gym.Failures, informed: bool, generations: int) -> np.ndarray:
    """The weights of a policy, (nv, features)."""
    size, rows = 24 + 21 * informed, 7
    search = cma.CMAEvolutionStrategy(
        np.zeros(rows * size), SIGMA, {"seed": 1, "verbose": -9, "CMA_diagonal": True, "popsize": 16}
    )
    env = ftqp_gym.FaultyArmVec(
        16 * EPISODES, layer="joints", failures=failures, seconds=SECONDS, autoreset_mode="Disabled"
    )
    begun = perf_counter()
    for k in range(generations):
        asked = search.ask()
        weights = np.repeat(np.array(asked).reshape(16, rows, size), EPISODES, axis=0)
        total, left = rollout(
            env, weights, informed, [*range(1000 + k * EPISODES, 1000 + (k + 1) * EPISODES)] * 16
        )
        search.tell(asked, (-total.reshape(16, EPISODES).mean(axis=1)).tolist())
        if k % 20 == 19:
            print(
                f"  {k + 1}: {1e3 * np.median(left):.1f} mm left, {perf_counter() - begun:.0f} s", flush=True
            )
    return np.asarray(search.result.xfavorite).reshape(rows, size)


def left_of(layer: str, weights: np.ndarray, informed: bool, joint: int | None) -> np.ndarray:
    """What is left at the end of each episode [mm]."""
    env = ftqp_gym.FaultyArmVec(JUDGED, layer=layer, seconds=SECONDS, autoreset_mode="Disabled")
    failure = None if joint is None else (joint, ftqp_gym.LOCKED, WHEN)
    seeds = [*range(2_000_000, 2_000_000 + JUDGED)]
    repeated = np.repeat(weights[None], JUDGED, axis=0)
    return 1e3 * rollout(env, repeated, informed, seeds, {"failure": failure})[1]


def main() -> None:
    """Train, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true")
    generations = GENERATIONS // 10 if parser.parse_args().quick else GENERATIONS
    healthy = trained(ftqp_gym.Failures(share=0.0), False, generations)
    locks = ftqp_gym.Failures(share=0.5, kinds=(ftqp_gym.LOCKED,), between=(0.2, 1.0))
    informed = trained(locks, True, generations)
    print(f"cma {cma.__version__}, seed 1, {generations} generations, {JUDGED} episodes a row\n")
    print("| joint that locks | trained healthy | the same with ftqp below it | trained with locks |")
    print("|---|---|---|---|")
    for joint in (None, *range(7)):
        columns = (("joints", healthy, False), ("below", healthy, False), ("joints", informed, True))
        cells = [left_of(*one, joint) for one in columns]
        said = " | ".join(f"{np.mean(one < 10.0):.0%}, {np.quantile(one, 0.9):.1f}" for one in cells)
        print(f"| {'none' if joint is None else joint + 1} | {said} |", flush=True)


if __name__ == "__main__":
    main()
