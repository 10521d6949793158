"""Your own robot from a URDF: `python 02_your_own_urdf.py my_arm.urdf --tip tool0`.

Without a file a small arm is made. The end effector reaches the end of its line although a joint locks.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("urdf", nargs="?", help="a URDF file")
arguments.add_argument("--tip", default="tip", help="frame that follows the task")
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

INERTIA = '<mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/>'
LINK = '<link name="l{}"><inertial>' + INERTIA + "</inertial></link>"
JOINT = '<joint name="j{0}" type="revolute"><parent link="l{1}"/><child link="l{0}"/><origin xyz="0 0 .2"/>'
JOINT += '<axis xyz="{2}"/><limit lower="-2.5" upper="2.5" velocity="2" effort="80"/></joint>'
END = '<joint name="end" type="fixed"><parent link="l7"/><child link="tip"/><origin xyz="0 0 .1"/></joint>'
AXES = ["0 0 1", "0 1 0"]
PARTS = [*map(LINK.format, range(8)), *(JOINT.format(i + 1, i, AXES[i % 2]) for i in range(7))]

with tempfile.TemporaryDirectory() as folder:
    file = Path(given.urdf) if given.urdf else Path(folder) / "seven.urdf"
    if not given.urdf:
        file.write_text(f'<robot name="seven">{"".join(PARTS)}<link name="tip"/>{END}</robot>')
    robot = ftqp.Robot.from_urdf(file, tip=given.tip, acceleration=10.0)

planner = ftqp.Planner(robot, dt=2e-3)
q, v = robot.neutral + 0.4 * (robot.neutral == 0.0), np.zeros(robot.nv)
path = ftqp.paths.Line(robot.pose(q), [0.0, 0.0, -0.05], duration=2.0)
planner.reset(q)
motion, errors = [], []
for t in np.arange(0.0, 2.5, planner.dt):
    if abs(t - 1.0) < 0.5 * planner.dt:
        planner.report(ftqp.Locked(2))
    at = path.sample(t)
    target = ftqp.Target(pose=at.pose[0], twist=at.twist[0], acceleration=at.acceleration[0])
    step = planner.step(q, v, target)
    q, v = step.q.copy(), step.v.copy()
    motion.append(q)
    errors.append(1e3 * step.position_error)

print(f"joints of {robot.name}: {robot.nv}")
print(f"position error at the end: {1e3 * step.position_error:.3f} mm")
print(f"largest torque at the end: {np.abs(step.tau).max():.1f} N m")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    curves = {"off its line [mm]": {"end effector": (planner.dt * np.arange(len(errors)), errors)}}
    title = f"{robot.name}: an arm from a URDF loses a joint"
    draw_loop(given.figure, title, curves, arm=(robot, motion), fault=(1.0, "joint 3 locks"))
