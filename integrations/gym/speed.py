"""Steps of FaultyArmVec in a second of the CPU: ``python speed.py [arms]`` prints the table of the README."""

import sys
from time import process_time

import ftqp_gym

STEPS = 200


def main() -> None:
    """Print the table."""
    arms = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    print("| layer | steps a second and core |\n|---|---|")
    for layer in ("tip", "joints", "below"):
        envs = ftqp_gym.FaultyArmVec(arms, layer=layer, threads=1)
        envs.reset(seed=1)
        envs.action_space.seed(1)
        actions = [envs.action_space.sample() for _ in range(STEPS)]
        begin = process_time()
        for one in actions:
            envs.step(one)
        print(f"| `{layer}` | {arms * STEPS / (process_time() - begin):,.0f} |", flush=True)


if __name__ == "__main__":
    main()
