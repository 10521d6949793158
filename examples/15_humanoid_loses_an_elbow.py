"""A humanoid lifts a tray with both hands and looks at it, and an elbow locks.

The waist makes up for the elbow; without it the robot comes to rest short of the place. It needs Talos: pip
install -e ".[robots]".
"""

import argparse
import sys
from pathlib import Path

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

files = next(Path(sys.prefix).glob("**/share/example-robot-data/robots"), None)
if files is None:
    sys.exit('the files of Talos are not installed; pip install -e ".[robots]"')
left, right, head = hands = ("gripper_left_base_link", "gripper_right_base_link", "head_2_link")
robot = ftqp.Robot.from_urdf(files / "talos_data" / "robots" / "talos_reduced.urdf", tips=hands)
arm = np.array([0.26, 0.17, 0.0, -1.6, 0.0, 0.0, 0.1])
start = np.concatenate([[0.0, 0.1], arm, arm * [-1, -1, 1, 1, 1, 1, 1], [0.5, 0.0]])
DT, TICKS, LIFT = 2e-3, 2000, np.array([0.1, 0.0, 0.25])
way = ftqp.paths.Line(robot.pose(start), LIFT, duration=0.6 * TICKS * DT).sample(DT * np.arange(TICKS))
targets = ftqp.Targets(way.pose, way.twist, way.acceleration)
tray = ftqp.Task("pose", mode="scaled")  # of the left hand, which takes the tray along
soft = [
    ftqp.RelativeTask(right, left, level=0, name="grip"),
    ftqp.AxisTask(head, axis=(1, 0, 0), towards=left, name="look"),
    ftqp.CentreOfMass("xy", name="balance"),
]
elbow, waist = ftqp.Locked("arm_left_4_joint"), [ftqp.Locked(f"torso_{k}_joint") for k in (1, 2)]
cases = {"healthy": [], "the elbow locks": [elbow], "elbow and waist lock": [elbow, *waist]}
offs, looks, runs, times = {}, {}, {}, DT * np.arange(TICKS)
for name, locks in cases.items():
    planner = ftqp.Planner(robot, DT, task=tray, tasks=soft, emergency=None)
    planner.reset(start)
    off, past, motion = [], [], [start]
    for k in range(TICKS):
        for lock in locks if k == TICKS // 5 else ():
            planner.report(lock)
        step = planner.step(motion[-1], None, targets.at(k))
        off.append(1e3 * step.position_error)
        past.append(np.degrees(np.arcsin(np.linalg.norm(step.tasks["look"].error))))
        motion.append(step.q.copy())
    offs[name], looks[name], runs[name] = (times, off), (times, past), np.array(motion)
    print(f"{name}: tray {off[-1]:.1f} mm off, gaze {past[-1]:.0f} degrees past, {step.status.name}")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    panels, fault = {"tray to its place [mm]": offs, "gaze past the hand [deg]": looks}, (0.8, "lock")
    shown = robot, runs["the elbow locks"]
    draw_loop(given.figure, "Talos lifts a tray", panels, arm=shown, fault=fault)
