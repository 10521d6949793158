"""An arm goes round a wall, a joint locks half-way, and the remaining joints find another way.

Where the arm cannot go straight, `GoTo` searches a way of the joints. The live page shows it as a ghost.
"""

import argparse
from itertools import combinations, product

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
DT, LOCK = 2e-3, 300
scene = ftqp.Scene()
scene.add("wall", ftqp.Box(size=(0.5, 0.06, 0.7), place=(0.6, 0.0, 0.35)))
planner = ftqp.Planner(robot, DT, scene=scene, clearance=ftqp.Clearance(keep=0.02))

start = np.array([-0.8, 0.5, 0.0, -1.8, 0.0, 2.3, 0.785])
beyond = start * [-1, 1, 1, 1, 1, 1, 1]
planner.reset(start)
goto = ftqp.GoTo(planner, pose=robot.pose(beyond))
page = None if given.headless else ftqp.view(planner, start)
q, motion, searched = start, [start], [0, 0]
while not goto.done:
    if len(motion) == LOCK:
        planner.report(ftqp.Locked("panda_joint3", mode="instant"))
    step = goto.step(q)
    q = step.q.copy()
    motion.append(q)
    searched[len(motion) > LOCK] += goto.note.startswith("the straight way cannot be gone")
    if page is not None:
        page.show(step, way=goto.way)

apart = planner.distances(np.array(motion))
near = 1e3 * np.min([distance for pair, distance in apart.items() if "wall" in pair], axis=0)
print(
    f"looks for a way, and for another when joint 3 locks: {DT * searched[0]:.2f} s, {DT * searched[1]:.2f} s"
)
print(f"{goto.sentence}, after: {DT * len(motion):.2f} s")
print(f"least distance from the wall: {near.min():.0f} mm")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    corners = np.array(list(product((0.35, 0.85), (-0.03, 0.03), (0.0, 0.7))))
    edges = [(a, b) for a, b in combinations(corners, 2) if (a != b).sum() == 1]
    panels = {"arm to wall [mm]": {"arm": (DT * np.arange(len(motion)), near)}}
    title, locks = "Round a wall, and a joint that locks", (DT * LOCK, "joint 3 locks")
    draw_loop(given.figure, title, panels, arm=(robot, motion), fault=locks, edges=edges)
