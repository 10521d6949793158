"""Ways to a goal: whatever fails on the way, every limit is kept and the end is said."""

import numpy as np

import ftqp

LEVELS = ["acceleration", "velocity"]
DT = 4e-3


def test_random_ways_end_within_limits_and_say_so():
    """Robots, goals, starts outside the limits or moving, faults and a lost sample, all at random."""
    robots = [ftqp.robots.load(name) for name in ("panda", "iiwa14", "planar(4)")]
    for seed in range(18):
        rng = np.random.default_rng(seed)
        robot = robots[seed % 3]
        low, high = np.maximum(robot.limits.q_min, -3.0), np.minimum(robot.limits.q_max, 3.0)
        start, goal = (low + (high - low) * rng.uniform(0.1, 0.9, robot.nv) for _ in range(2))
        if seed % 5 == 0:
            start[0] = high[0] + 0.05
        v = rng.uniform(-0.3, 0.3, robot.nv) * (seed % 4 == 0)
        planner = ftqp.Planner(robot, DT, level=LEVELS[seed // 3 % 2])
        planner.reset(start, v)
        goto = ftqp.GoTo(planner, **({"q": goal} if seed % 2 else {"pose": robot.pose(goal)}))
        joint, at, lost = int(rng.integers(robot.nv)), int(rng.integers(600)), int(rng.integers(900))
        fault = (ftqp.Locked(joint), ftqp.Degraded(joint, velocity=0.4), ftqp.Degraded(joint, torque=0.6))[
            int(rng.integers(3))
        ]
        q, before = start, v
        for k in range(round(25.0 / DT)):
            if k == at:
                planner.report(fault)
            step = goto.step(np.full(robot.nv, np.nan) if k == lost else q, before)
            assert (np.abs(step.v) <= robot.limits.v_max * (1.0 + 1e-9)).all(), f"seed {seed}"
            healthy = [name not in planner.faults for name in robot.joints]
            change = np.abs(step.v - before)[healthy]
            assert (change <= DT * robot.limits.a_max[healthy] * (1.0 + 1e-6)).all(), f"seed {seed}"
            q, before = step.q.copy(), step.v.copy()
            assert np.isfinite(q).all()
            if goto.done:
                break
        assert goto.done, f"seed {seed}"
        assert goto.status is not ftqp.GoToStatus.HALTED, f"seed {seed}"
        if seed % 2 and goto.status is ftqp.GoToStatus.UNREACHABLE:
            off = np.abs(goto.joint_error) > 1e-3
            assert off.any() and not off[planner.view().working].any(), f"seed {seed}"
