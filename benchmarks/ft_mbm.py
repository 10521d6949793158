"""Goals of MotionBenchMaker's Panda among boxes and cylinders, gone to by ``ftqp.GoTo`` and judged by meshes.

Each problem is a start, a goal posture and a scene; the goal is taken as a posture, and as the pose of the
tip there. An ideal arm goes where it is told. The true meshes, which coal measures every 20 ms, say how near
it came. They are those of the package example-robot-data, the fingers left out. Problems and their licence:
benchmarks/problems.
"""

import argparse
import json
from pathlib import Path
from time import perf_counter, process_time
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

import ftqp
from ftqp.control.following.ways import Ways
from ftqp.model.collision_geometry import around

PROBLEMS = Path(__file__).parent / "problems/motion_bench_maker.json"
SHARE = Path(pin.__file__).parents[4] / "share"
FOLDER = SHARE / "example-robot-data/robots"
NEVER = [("panda_hand", f"panda_link{k}") for k in (5, 6, 7)]
BOX, LONGEST = 2, 40.0
LOOKS = 50


class Judge:
    """The true meshes: how near the arm is to a scene and to itself."""

    def __init__(self):
        urdf, share = str(FOLDER / "panda_description/urdf/panda.urdf"), [str(SHARE), str(FOLDER)]
        model = pin.buildModelFromUrdf(urdf)
        geometry = pin.buildGeomFromUrdf(model, urdf, pin.GeometryType.COLLISION, package_dirs=share)
        held = [model.getJointId(name) for name in model.names if "finger" in name]
        self.model, geometry = pin.buildReducedModel(model, geometry, held, pin.neutral(model))
        self.data = self.model.createData()
        self.bodies = [one for one in geometry.geometryObjects if "finger" not in one.name]
        self.names = [one.name.rsplit("_", 1)[0] for one in self.bodies]
        for one in self.bodies:
            one.geometry.buildConvexRepresentation(False)
        srdf = ElementTree.parse(FOLDER / "panda_description/srdf/panda.srdf").getroot()
        rows = srdf.findall("disable_collisions")
        never = {frozenset((row.get("link1"), row.get("link2"))) for row in rows}
        never |= {frozenset(pair) for pair in NEVER}
        self.pairs = [
            (i, j)
            for i in range(len(self.bodies))
            for j in range(i)
            if frozenset((self.names[i], self.names[j])) not in never
        ]

    def arm(self):
        """The Panda of the catalog, its bodies those of the meshes."""
        bodies = []
        for name, one in zip(self.names, self.bodies, strict=True):
            T = one.placement
            corners = np.array(one.geometry.vertices()) @ T.rotation.T + T.translation
            frame = f"panda_joint{one.parentJoint}" if one.parentJoint else "universe"
            bodies += [
                ftqp.Capsule(a, b, r + 1e-5, frame=frame, name=name, corners=inside)
                for a, b, r, inside in around(corners)
            ]
        return ftqp.robots.load("panda").with_capsules(bodies)

    def least(self, things, postures):
        """The least distance at some postures [m]."""
        least, ask, got = np.inf, coal.DistanceRequest(), coal.DistanceResult()
        for q in postures:
            pin.forwardKinematics(self.model, self.data, q)
            at = [self.data.oMi[one.parentJoint] * one.placement for one in self.bodies]
            at = [coal.Transform3s(T.rotation, T.translation) for T in at]
            pairs = [
                (one.geometry.convex, T, *thing)
                for one, T in zip(self.bodies, at, strict=True)
                if one.parentJoint
                for thing in things
            ]
            pairs += [
                (self.bodies[i].geometry.convex, at[i], self.bodies[j].geometry.convex, at[j])
                for i, j in self.pairs
            ]
            for pair in pairs:
                got.clear()
                least = min(least, coal.distance(*pair, ask, got))
        return least


def things_of(problem):
    """The scene of a problem, and the same for coal."""
    scene, things = ftqp.Scene(), []
    for k, (kind, *row) in enumerate(problem["bodies"]):
        place, size = np.eye(4), np.array(row[6:])
        place[:3, :3], place[:3, 3] = pin.exp3(np.array(row[3:6], float)), row[:3]
        if kind == BOX:
            scene.add(f"box {k}", ftqp.Box(2.0 * size, place))
            shape = coal.Box(*(2.0 * size))
        else:
            scene.add(f"cylinder {k}", ftqp.Cylinder(size[1], 2.0 * size[0], place))
            shape = coal.Cylinder(size[1], 2.0 * size[0])
        things.append((shape, coal.Transform3s(place[:3, :3], place[:3, 3])))
    return scene, things


def searched(planner, start, **goal):
    """Seconds of the processor until there is a way, and until its motion is ready; None without one."""
    ways, t = Ways(planner, start, **goal), process_time()
    first = None
    while ways.is_thinking:
        ways.think(LOOKS)
        first = process_time() - t if first is None and ways.has_way else first
    return None if first is None else (first, process_time() - t)


def gone(motion, start, dt):
    """The postures of every tick until the arm is done, and the longest tick [s]."""
    q, v, rows, longest = start.copy(), np.zeros(len(start)), [start], 0.0
    for _ in range(round(LONGEST / dt)):
        t = perf_counter()
        step = motion.step(q, v)
        longest = max(longest, perf_counter() - t)
        q, v = step.q.copy(), step.v.copy()
        rows.append(q)
        if motion.done:
            break
    return np.array(rows), longest


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="every fifth problem")
    parser.add_argument("--keep", type=float, default=0.002, help="the clearance that is kept [m]")
    parser.add_argument("--dt", type=float, default=0.004, help="the tick [s]")
    given = parser.parse_args()
    judge = Judge()
    robot, found = judge.arm(), {"posture": [], "pose": []}
    for problem in json.loads(PROBLEMS.read_text())[:: 5 if given.quick else 1]:
        start, goal = (np.array(problem[name], float) for name in ("start", "goal"))
        scene, things = things_of(problem)
        for kind, rows in found.items():
            clearance = ftqp.Clearance(keep=given.keep, stop=0.0)
            planner = ftqp.Planner(robot, given.dt, scene=scene, clearance=clearance)
            planner.reset(start)
            posture = kind == "posture"
            pose = robot.pose(goal)
            seconds = searched(planner, start, **({"goals": [goal]} if posture else {"goal": pose}))
            motion = ftqp.GoTo(planner, **({"q": goal} if posture else {"pose": pose}))
            gone_by, longest = gone(motion, start, given.dt)
            least = judge.least(things, gone_by[:: max(1, round(0.02 / given.dt))])
            reached = motion.status is ftqp.GoToStatus.REACHED
            rows.append((reached, least, len(gone_by) * given.dt, seconds, longest))
            if not reached:
                print(f"{kind} {problem['set']} {problem['number']}: {motion.sentence}", flush=True)
    print(f"keep {1e3 * given.keep:g} mm, dt {1e3 * given.dt:g} ms; median and 95 %")
    for kind, rows in found.items():
        ways = 1e3 * np.percentile([row[3] for row in rows if row[3] is not None], [50, 95], axis=0)
        time = np.percentile([row[2] for row in rows if row[0]], [50, 95])
        print(
            f"goal a {kind:8s} reached {sum(row[0] for row in rows)} of {len(rows)}, "
            f"touches {sum(row[1] <= 0.0 for row in rows)}, least distance by meshes "
            f"{1e3 * min(row[1] for row in rows):.1f} mm, there in {time[0]:.1f} {time[1]:.1f} s; "
            f"first way {ways[0, 0]:.1f} {ways[1, 0]:.1f} ms, motion {ways[0, 1]:.1f} {ways[1, 1]:.1f} ms "
            f"of the processor"
        )


if __name__ == "__main__":
    main()
