"""A bound on speed that set in at an error of a millimetre made an arm hunt across it for ever.

Found by ``ftqp campaign safety``, episode 99111 of 100,000.
"""

import numpy as np

import ftqp

START = (
    -0.612929545060054, -1.6780663723557694, 0.3893573447972289, -1.3159288133532225,
    0.16832009325832187, 0.724165848230235, 0.08907292442603873,
)  # fmt: skip


def test_an_arm_whose_last_millimetre_cannot_be_had_comes_to_rest():
    robot = ftqp.robots.load("zhang7")
    dt = 0.01
    planner = ftqp.Planner(robot, dt, level="velocity", scheme="rmp")
    q = np.array(START)
    planner.reset(q)
    path = ftqp.paths.Circle(robot.pose(q), radius=0.084957865455807, duration=0.9808366061396421)
    samples = path.sample(dt * np.arange(900))
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration)
    fastest = []
    for k in range(900):
        if k == 22:
            planner.report(ftqp.Locked(4))
        step = planner.step(q, None, targets.at(k))
        q = step.q.copy()
        fastest.append(np.abs(step.v / robot.limits.v_max).max())
    assert max(fastest[800:]) < 2e-3  # 0.064, for ever, before
