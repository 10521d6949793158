"""An arm on a satellite moves its tool along a line, and a joint locks.

The planner takes into account that the arm's motion turns the satellite. One that assumes a base at rest
misses the line.
"""

import argparse

import numpy as np
import pinocchio as pin

import ftqp
from ftqp.model.serial import Inertial

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

arm = ftqp.robots.load("panda")
robot = arm.on_free_base(Inertial(mass=150.0, com=np.zeros(3), inertia=np.diag([20.0, 15.0, 18.0])))
DT, TICKS = 2e-3, 2000
line = ftqp.paths.Line(robot.pose(robot.neutral), (-0.1, 0.3, 0.2), duration=0.8 * TICKS * DT)
way = line.sample(DT * np.arange(TICKS))
targets = ftqp.Targets(way.pose, way.twist, way.acceleration)


def react(q: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """The satellite after a small motion of the arm at q: momentum stays 0."""
    M = pin.crba(robot.model, robot.model.createData(), robot.configuration(q))
    return q[:6] - np.linalg.solve(np.triu(M[:6, :6]) + np.triu(M[:6, :6], 1).T, M[:6, 6:] @ moved)


cases = {
    "with the reaction": (robot, None),
    "with it, a joint locks": (robot, ftqp.Locked("panda_joint3")),
    "assumes a base at rest": (arm, None),
}
offs, turns, times = {}, {}, DT * np.arange(TICKS)
for name, (model, fault) in cases.items():
    planner = ftqp.Planner(model, DT, level="velocity", emergency=None)
    q, off, turned = robot.neutral.copy(), [], []
    planner.reset(q[-model.nv :])
    for k in range(TICKS):
        if fault is not None and k == TICKS // 4:
            planner.report(fault)
        step = planner.step(q[-model.nv :], None, targets.at(k))
        joints = step.q[-7:].copy()
        q = np.r_[react(q, joints - q[6:]), joints]
        off.append(1e3 * float(np.linalg.norm(robot.pose(q)[:3, 3] - way.pose[k][:3, 3])))
        turned.append(float(np.degrees(np.linalg.norm(q[3:6]))))
    offs[name], turns[name] = (times, off), (times, turned)
    print(f"{name}: tool {off[-1]:.1f} mm off, satellite turned by {turned[-1]:.1f} degrees")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    panels = {"tool off its place [mm]": offs, "satellite turned [deg]": turns}
    draw_loop(given.figure, "An arm on a satellite", panels)
