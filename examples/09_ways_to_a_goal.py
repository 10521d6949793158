"""An arm loses a joint while an operator drives it, and goes home all the same.

The joystick's messages end, the end effector comes to rest, and the arm goes home with six of seven joints.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
home = robot.neutral
planner = ftqp.Planner(robot, dt=1e-3)
operator = ftqp.TargetFollower(planner, ftqp.TipLimits(speed=0.25), dead_man=0.2)
q, v = home.copy(), np.zeros(robot.nv)
planner.reset(q)

message = ftqp.Target(twist=[0.0, 0.2, 0.1, 0.0, 0.0, 0.3], stamp=0)
lost, motion = None, []
for k in range(2000):
    if k < 1000 and k % 20 == 0:  # the joystick sends at 50 Hz, and no more after a second
        message.stamp = k * planner.dt
    if k == 500:
        planner.report(ftqp.Locked("panda_joint4"))
    step = operator.step(q, v, message)
    q, v = step.q.copy(), step.v.copy()
    motion.append(q)
    if lost is None and operator.status is ftqp.TargetStatus.STALE:
        lost = k * planner.dt
print(f"messages end at 0.98 s, the twist is stale at: {lost:.2f} s")

goto = ftqp.GoTo(planner, q=home)
while not goto.done:
    step = goto.step(q, v)
    q, v = step.q.copy(), step.v.copy()
    motion.append(q)
six = np.delete(np.abs(q - home), robot.joint("panda_joint4"))
print(f"largest miss of the six joints that work: {six.max():.1e} rad")
print(f"what it says: {goto.sentence}")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    t, away = planner.dt * np.arange(len(motion)), np.transpose(motion - home)
    curves = {name: (t, values) for name, values in zip(robot.joints, away, strict=True)}
    title, locks = "Driven by a joystick, then home", (0.5, "joint 4 locks")
    draw_loop(given.figure, title, {"from home [rad]": curves}, arm=(robot, motion), fault=locks)
