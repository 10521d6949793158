"""OMPL's RRT-Connect among the true meshes: coal looks at postures, called from Python, every 0.05 rad."""

from time import process_time

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou
import pinocchio as pin

from peers.asked_ways import LONGEST, answer_all
from peers.true_meshes import Judge, things_of

SPACING, REACH = 0.05, 1.0


def make():
    """What answers a question."""
    ou.setLogLevel(ou.LogLevel.LOG_NONE)
    ou.RNG.setSeed(1)
    judge = Judge()
    model, data = judge.model, judge.model.createData()

    def ask(bodies, start, goal, failed):
        geometry = judge.scene_with(things_of(bodies))
        asked = pin.GeometryData(geometry)
        free = [k for k in range(model.nq) if k not in failed]
        q = start.copy()

        def clear(state):
            q[free] = [state[k] for k in range(len(free))]
            return not pin.computeCollisions(model, data, geometry, asked, q, True)

        low, high = model.lowerPositionLimit[free], model.upperPositionLimit[free]
        space, bounds = ob.RealVectorStateSpace(len(free)), ob.RealVectorBounds(len(free))
        for k, (least, most) in enumerate(zip(low, high, strict=True)):
            bounds.setLow(k, float(least))
            bounds.setHigh(k, float(most))
        space.setBounds(bounds)
        t = process_time()
        about = ob.SpaceInformation(space)
        about.setStateValidityChecker(clear)
        about.setStateValidityCheckingResolution(SPACING / float(np.linalg.norm(high - low)))
        about.setup()
        problem, ends = ob.ProblemDefinition(about), [space.allocState(), space.allocState()]
        for end, posture in zip(ends, (start, goal), strict=True):
            for k, value in enumerate(posture[free]):
                end[k] = float(value)
        problem.setStartAndGoalStates(*ends)
        planner = og.RRTConnect(about)
        planner.setRange(REACH)
        planner.setProblemDefinition(problem)
        planner.setup()
        planner.solve(LONGEST)
        taken = process_time() - t
        if not problem.hasExactSolution():
            return None, taken
        states = problem.getSolutionPath().getStates()
        places = np.tile(start, (len(states), 1))
        places[:, free] = [[state[k] for k in range(len(free))] for state in states]
        return places, taken

    return ask


if __name__ == "__main__":
    answer_all(make(), ("ompl", "pin", "coal"))
