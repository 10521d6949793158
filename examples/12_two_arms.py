"""Two arms carry a bar, and a joint of the left one locks.

The grip is a task before that of the bar (`RelativeTask` on level 0): the bar gives way, and the grip
holds.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("dual_panda")
left, right = robot.tips
DT, TICKS, WAY = 2e-3, 2000, np.array([-0.1, 0.05, 0.2])
line = ftqp.paths.Line(robot.pose(robot.neutral), WAY, duration=0.6 * TICKS * DT)
way = line.sample(DT * np.arange(TICKS))
bar = np.linalg.solve(robot.pose(robot.neutral, left), robot.pose(robot.neutral, right))

grip = ftqp.RelativeTask(right, left, level=0, name="grip")
hand = ftqp.PoseTask(right, level=0, name="grip")
lock = ftqp.Locked("left_joint6")
cases = {
    "grip": (grip, None),
    "grip, a joint locks": (grip, lock),
    "a target for each hand, a joint locks": (hand, lock),
}
slips, offs, times = {}, {}, DT * np.arange(TICKS)
for name, (second, fault) in cases.items():
    planner = ftqp.Planner(robot, DT, tasks=[ftqp.Task("pose", mode="scaled"), second], emergency=None)
    planner.reset(robot.neutral)
    q, slip, off = robot.neutral, [], []
    for k in range(TICKS):
        if fault is not None and k == TICKS // 5:
            planner.report(fault)
        moves = {"twist": way.twist[k], "acceleration": way.acceleration[k]}  # the same for both
        targets = {"tip": ftqp.Target(way.pose[k], **moves)}
        if second is hand:
            targets["grip"] = ftqp.Target(way.pose[k] @ bar, **moves)
        step = planner.step(q, None, targets)
        q = step.q.copy()
        held = np.linalg.solve(robot.pose(q, left), robot.pose(q, right))
        slip.append(1e3 * float(np.linalg.norm((held - bar)[:3, 3])))
        off.append(1e3 * step.position_error)
    slips[name], offs[name] = (times, slip), (times, off)
    print(f"{name}: slip {max(slip):.3f} mm, bar {off[-1]:.1f} mm from its end, {step.status.name}")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    panels = {"slip of the grip [mm]": slips, "bar to its place [mm]": offs}
    draw_loop(given.figure, "Two arms with a bar", panels)
