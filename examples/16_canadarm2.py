"""A joint of Canadarm2 locks while its hand moves by 1.5 m; each of the seven is tried.

Every line is finished with the remaining six joints. A simulation with published figures, not the flight
software: base and links are rigid, there is no load, and the lock is reported at once.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("canadarm2")
DT, WAY = 0.01, np.array([-0.9, -1.2, 0.0])  # s, m: the bundled scenario canadarm2-wrist
path = ftqp.paths.Line(robot.pose(robot.neutral), WAY, duration=96.0)
times = np.arange(0.0, path.duration, DT)
sample = path.sample(times)
targets = ftqp.Targets(sample.pose, sample.twist, sample.acceleration)
errors, worst, end, motions, done = {}, {}, {}, {}, 0
for joint in robot.joints:
    planner = ftqp.Planner(robot, dt=DT, task=ftqp.Task("pose", kp=0.25, kv=1.0))
    planner.reset(robot.neutral)
    q, error, motion = robot.neutral, [], []
    for k in range(len(times)):
        if k == len(times) // 2:
            planner.report(ftqp.Locked(joint))
        step = planner.step(q, None, targets.at(k))
        q = step.q.copy()
        error.append(1e3 * step.position_error)
        motion.append(q)
    errors[joint], motions[joint] = (times[50:], error[50:]), motion
    worst[joint], end[joint] = max(error), error[-1]
    done += step.status == ftqp.StepStatus.OK and end[joint] < 0.01

most, least = max(worst, key=worst.__getitem__), min(worst, key=worst.__getitem__)
print(f"lines finished with one joint locked: {done} of {robot.nv}")
print(f"farthest from the line: {worst[most]:.3f} mm without {most}, {worst[least]:.4f} mm without {least}")
print(f"farthest from its end: {max(end.values()):.4f} mm")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    panels = {"off its line [mm]": errors}
    title, arm = "Canadarm2 loses each joint in turn (arm: wrist_yaw)", (robot, motions["wrist_yaw"])
    label = list(panels)
    draw_loop(given.figure, title, panels, logarithmic=label, arm=arm, fault=(48.0, "a joint locks"))
