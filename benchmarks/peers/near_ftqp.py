"""ftqp past balls: a planner at the velocity or the acceleration level that was given a scene."""

import sys
from importlib.metadata import version

import numpy as np

import ftqp
from peers.motion_case import run_all
from peers.near_case import read_near


def maker(level):
    """What makes the step of a case."""

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
    run_all(maker(sys.argv[3]), read_near(sys.argv[1]), sys.argv[2], {"ftqp": version("ftqp")})
