"""A tool goes round a circle and looks at one place meanwhile, also when a joint locks.

How far its axis points past the place: without the soft task `AxisTask`, with it, and after a lock.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
PLACE, DT, TICKS = np.array([0.6, 0.1, 0.0]), 2e-3, 2000
circle = ftqp.paths.Circle(robot.pose(robot.neutral), radius=0.1, duration=TICKS * DT)
way = circle.sample(DT * np.arange(TICKS))
targets = ftqp.Targets(way.pose, way.twist, way.acceleration)

look = ftqp.AxisTask("panda_hand_tcp", axis=(0, 0, 1), towards=PLACE)
cases = {
    "no AxisTask": ([], None),
    "AxisTask": ([look], None),
    "AxisTask, a joint locks": ([look], ftqp.Locked("panda_joint3")),
}
lines = {}
for name, (soft, fault) in cases.items():
    planner = ftqp.Planner(robot, DT, tasks=[ftqp.Task(rows="position"), *soft])
    planner.reset(robot.neutral)
    q, past, off = robot.neutral, [], 0.0
    for k in range(TICKS):
        if fault is not None and k == TICKS // 4:
            planner.report(fault)
        step = planner.step(q, None, targets.at(k))
        q, T = step.q.copy(), robot.pose(step.q)
        sight = PLACE - T[:3, 3]
        past.append(np.degrees(np.arccos(np.clip(T[:3, 2] @ sight / np.linalg.norm(sight), -1.0, 1.0))))
        off = max(off, 1e3 * step.position_error)
    lines[name] = (DT * np.arange(TICKS), past)
    print(f"{name}: {np.mean(past[TICKS // 4 :]):.1f} degrees past the place, {off:.2f} mm off the circle")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    draw_loop(given.figure, "A tool that looks at a place", {"past the place [deg]": lines})
