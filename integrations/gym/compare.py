"""How near a policy that was written for the healthy arm comes to its points when a joint locks [mm].

The policy leads every joint by the pseudoinverse of the healthy arm. Alone (``joints``) it knows of no
failure; with ftqp below it (``below``) what it asks of the end effector is kept. ``python compare.py`` prints
the table of the README; it takes a minute.
"""

import ftqp_gym
import numpy as np

EPISODES, SECONDS, WHEN = 20, 4.0, 0.2
SLOWS = 0.05
"""The policy slows down so near to its point [m]."""


def left_of(layer: str, joint: int | None) -> np.ndarray:
    """What is left at the end of each episode [mm]."""
    env, left = ftqp_gym.FaultyArm(layer=layer, seconds=SECONDS), []
    robot, n = env.robot, env.robot.nv
    for seed in range(EPISODES):
        failure = None if joint is None else (joint, ftqp_gym.LOCKED, WHEN)
        seen, info = env.reset(seed=seed, options={"failure": failure})
        over = False
        while not over:
            way = ftqp_gym.FASTEST * np.clip(seen[2 * n : 2 * n + 3] / SLOWS, -1.0, 1.0)
            v = np.linalg.pinv(robot.jacobian(seen[:n])[:3]) @ way
            seen, _, _, over, info = env.step(v / (ftqp_gym.SHARE * robot.limits.v_max))
        left.append(1e3 * info["left"])
    return np.array(left)


def main() -> None:
    """Print the table."""
    print("| joint that locks | alone: median, worst | with ftqp below it |\n|---|---|---|")
    for joint in (None, *range(7)):
        cells = [left_of(layer, joint) for layer in ("joints", "below")]
        said = " | ".join(f"{np.median(one):.1f}, {one.max():.1f}" for one in cells)
        print(f"| {'none' if joint is None else joint + 1} | {said} |", flush=True)


if __name__ == "__main__":
    main()
