"""ftqp along cases: ``planner.step``, a ``PathFollower`` with bridges or not, ``GoTo``, or past balls."""

import sys

import numpy as np

import ftqp
from peers.motion_case import read, run_all

LONGEST, WAITED = 60.0, 1.0
"""A path that is followed by its progress may take so long; a motion that is over and stands for the second
one has ended [s]."""
STANDS = 1e-6
"""Joints slower than this stand [rad/s]."""
FOLLOWERS = ("follower", "bridges")
"""Ways that end by themselves, and have the case's rest behind their end."""
LEVELS = ("velocity", "acceleration")
"""Ways that are planners past balls."""
ENDS = (
    ftqp.PathStatus.DONE, ftqp.PathStatus.BLOCKED, ftqp.GoToStatus.REACHED, ftqp.GoToStatus.UNREACHABLE,
)  # fmt: skip


def maker(way):
    """What makes the step of a case; an arm that has arrived or given up is stepped on."""
    robots = {}

    def make(case):
        if case.urdf not in robots:
            low, high, speed, acceleration = case.limits
            robot = ftqp.Robot.from_urdf(case.urdf, tip=case.tip)
            robots[case.urdf] = robot.with_limits(q_min=low, q_max=high, v_max=speed, a_max=acceleration)
        robot = robots[case.urdf]
        scaled = {"task": ftqp.Task(mode="scaled")} if way in FOLLOWERS else {}
        planner = ftqp.Planner(robot, case.dt, **scaled)
        q, v = np.array(case.q), np.zeros(robot.nv)
        planner.reset(q)
        planner.report(ftqp.Locked(case.locked, mode="instant"))
        if way == "step":
            poses, twists = case.targets()
            accelerations = np.gradient(twists, case.dt, axis=0)
            targets = ftqp.Targets(poses, twists, accelerations)
            ask = lambda k: planner.step(q, v, targets.at(k))  # noqa: E731
        elif way in FOLLOWERS:
            line = ftqp.paths.PointToPoint(case.start, case.goal, duration=case.duration)
            follower = ftqp.PathFollower(planner, line, bridges=way == "bridges")
            ask = lambda k: follower.step(q, v)  # noqa: E731
        else:
            follower = goto = ftqp.GoTo(planner, pose=case.goal, straight=way == "straight")
            ask = lambda k: goto.step(q, v)  # noqa: E731

        waited = ended = 0.0

        def step(k):
            nonlocal waited, ended
            if way != "step":
                if waited > WAITED or (way in FOLLOWERS and k >= case.steps and ended > case.rest):
                    return None
                over = follower.status in ENDS
                ended = ended + case.dt if over else 0.0
                waited = waited + case.dt if over and bool((np.abs(v) < STANDS).all()) else 0.0
            done = ask(k)
            q[:], v[:] = done.q, done.v
            return q

        return step

    return make


def near_maker(level):
    """What makes the step of a case past balls, of a planner at a level that was given a scene."""

    def make(case):
        robot = ftqp.robots.load(case.arm)
        scene = ftqp.Scene()
        for k, (*place, radius) in enumerate(case.balls):
            scene.add(f"ball {k + 1}", ftqp.Sphere(radius, place))
        clearance = ftqp.Clearance(keep=case.keep, self_pairs=False)
        planner = ftqp.Planner(robot, case.dt, level=level, scene=scene, clearance=clearance, emergency=None)
        q, v = np.array(case.q), np.zeros(robot.nv)
        planner.reset(q)
        if case.locked >= 0:
            planner.report(ftqp.Locked(case.locked, mode="instant"))
        targets = ftqp.Targets(*case.targets())
        state = [q, v]

        def step(k):
            done = planner.step(*state, targets.at(k))
            state[:] = done.q.copy(), done.v.copy()
            return state[0]

        return step

    return make


if __name__ == "__main__":
    way = sys.argv[3]
    run_all(
        near_maker(way) if way in LEVELS else maker(way),
        read(sys.argv[1]), sys.argv[2], {"ftqp": ftqp.__version__},
        LONGEST if way in FOLLOWERS else 0.0, remembers=way not in LEVELS,
    )  # fmt: skip
