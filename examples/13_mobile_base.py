"""A Panda on a mobile base takes its tool two metres away, and a drive of the base locks.

Base and arm are joints of one robot, and the remaining joints make up for the locked one.
"""

import argparse

import numpy as np

import ftqp
from ftqp.model.serial import Inertial

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

BODY = Inertial(mass=60.0, com=np.zeros(3), inertia=np.diag([2.0, 2.0, 3.0]))
robot = ftqp.robots.load("panda").on_planar_base(v_max=(0.8, 0.8, 1.5), a_max=(2.0, 2.0, 4.0), inertial=BODY)
DT, TICKS = 2e-3, 3000
line = ftqp.paths.Line(robot.pose(robot.neutral), (1.8, 0.8, -0.1), duration=0.8 * TICKS * DT)
way = line.sample(DT * np.arange(TICKS))
targets = ftqp.Targets(way.pose, way.twist, way.acceleration)

cases = {"healthy": None, "base_x locks": ftqp.Locked("base_x"), "elbow locks": ftqp.Locked("panda_joint4")}
offs, driven, times = {}, {}, DT * np.arange(TICKS)
for name, fault in cases.items():
    planner = ftqp.Planner(robot, DT, task=ftqp.Task("position"), emergency=None)
    planner.reset(robot.neutral)
    q, off, base = robot.neutral, [], []
    for k in range(TICKS):
        if fault is not None and k == 2 * TICKS // 5:
            planner.report(fault)
        step = planner.step(q, None, targets.at(k))
        q = step.q.copy()
        off.append(1e3 * step.position_error)
        base.append(q[0])
    offs[name], driven[name] = (times, off), (times, base)
    print(f"{name}: {off[-1]:.1f} mm off, base at x {q[0]:.2f} m, y {q[1]:.2f} m, {step.status.name}")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    panels = {"tool to its place [mm]": offs, "base_x [m]": driven}
    draw_loop(given.figure, "An arm on a base that drives", panels)
