"""A wrist locks, and the elbow would move into a post; with a scene it does not.

A planner that makes up for a failure moves the elbow. Give it a scene where something stands in the way.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
DT, TICKS = 2e-3, 2500
line = ftqp.paths.Line(robot.pose(robot.neutral), (0.24, 0.03, -0.04), duration=0.8 * TICKS * DT)
way = line.sample(DT * np.arange(TICKS))
targets = ftqp.Targets(way.pose, way.twist, way.acceleration)

scene = ftqp.Scene()
scene.add("post", ftqp.Cylinder(radius=0.04, length=1.4, place=(0.08, 0.2, 0.7)))
ruler = ftqp.Planner(robot, DT, scene=scene, clearance=ftqp.Clearance(self_pairs=False))

cases = {
    "healthy": (None, None),
    "a wrist locks, no scene": (ftqp.Locked("panda_joint6"), None),
    "a wrist locks, with a scene": (ftqp.Locked("panda_joint6"), scene),
}
times, clear, offs = DT * np.arange(TICKS), {}, {}
for name, (fault, known) in cases.items():
    planner = ftqp.Planner(robot, DT, scene=known)
    planner.reset(robot.neutral)
    q, postures, off = robot.neutral, [], []
    for k in range(TICKS):
        if fault is not None and k == 750:
            planner.report(fault)
        step = planner.step(q, None, targets.at(k))
        q = step.q.copy()
        postures.append(q)
        off.append(1e3 * step.position_error)
    near = 1e3 * np.min(list(ruler.distances(np.array(postures)).values()), axis=0)
    clear[name], offs[name] = (times, near), (times, off)
    met = f"{near.min():.0f} mm from the post" if near.min() > 0.0 else f"{-near.min():.0f} mm into the post"
    print(f"{name}: at the nearest {met}, tool at most {max(off):.1f} mm off, {step.status.name}")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    panels = {"arm to post [mm]": clear, "tool to its line [mm]": offs}
    draw_loop(given.figure, "An arm past a post, and a wrist that locks", panels)
