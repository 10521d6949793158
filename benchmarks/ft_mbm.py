"""Goals of MotionBenchMaker's Panda among boxes and cylinders, gone to by ``ftqp.GoTo`` and judged by meshes.

Each problem is a start, a goal posture and a scene; the goal is taken as a posture, and as the pose of the
tip there; then as the pose with each joint locked at the start, with one that brakes half-way, and with one
that stops dead there. An ideal arm goes where it is told. The true meshes, which coal measures every 20 ms,
say how near it came, and an oracle that shares nothing with ftqp whether the pose can be reached with that
lock at all. Problems and their licence: benchmarks/problems.
"""

import argparse
import json
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from peers.independent_arm import IndependentArm
from peers.mesh_oracle import MeshOracle
from peers.true_meshes import Judge, things_of

import ftqp
from ftqp.control.planner.ways.ways import Ways

PROBLEMS = Path(__file__).parent / "problems/motion_bench_maker.json"
TOLERANCES = 1e-3, 5e-3
LOCKS = "locked at the start", "brakes half-way", "stops dead half-way"
LONGEST, RISE = 40.0, 0.05
LOOKS = 50


def searched(planner, start, **goal):
    """Seconds of the processor until there is a way, and until its motion is ready; None without one."""
    ways, t = Ways(planner, start, **goal), process_time()
    first = None
    while ways.is_thinking:
        ways.think(LOOKS)
        first = process_time() - t if first is None and ways.has_way else first
    return None if first is None else (first, process_time() - t)


def gone(motion, start, dt, lock=None, after=0, mode="instant"):
    """Every tick's posture, the longest tick [s], when a locked joint stood, how far it was moved then.

    Args:
        motion: What leads the arm.
        start: Where it begins, (nv,).
        dt: The tick [s].
        lock: The number of the joint that locks; None: none does.
        after: After so many ticks.
        mode: How it locks.
    """
    q, v, rows, longest, moved, stood = start.copy(), np.zeros(len(start)), [start], 0.0, 0.0, None
    for k in range(after + round(LONGEST / dt)):
        if lock is not None and k == after:
            motion.planner.report(ftqp.Locked(lock, mode=mode))
        t = perf_counter()
        step = motion.step(q, v)
        longest = max(longest, perf_counter() - t)
        new, v = step.q.copy(), step.v.copy()
        if lock is not None and k >= after:
            way = abs(new[lock] - q[lock])
            stood = k if stood is None and way < 1e-9 else stood
            moved = moved if stood is None else max(moved, way)
        q = new
        rows.append(q)
        if motion.done and k >= after:
            break
    return np.array(rows), longest, stood, moved


class Trial:
    """Goals of one problem, gone to and judged.

    Args:
        arm: The robot, the judge of its meshes, and the independent arm of the oracle.
        problem: A line of the problems.
        given: The arguments of the script.
    """

    def __init__(self, arm, problem, given):
        self.robot, self.judge, self.independent = arm
        self.given, self.name = given, f"{problem['set']} {problem['number']}"
        self.start, self.goal = (np.array(problem[name], float) for name in ("start", "goal"))
        self.scene, self.things = things_of(problem)
        self.pose = self.robot.pose(self.goal)

    def planner(self):
        """A planner at the start."""
        clearance = ftqp.Clearance(keep=self.given.keep, stop=0.0)
        planner = ftqp.Planner(self.robot, self.given.dt, scene=self.scene, clearance=clearance)
        planner.reset(self.start)
        return planner

    def goes(self, kind, *lock):
        """What comes of ``GoTo``, see ``gone``: a row of the table, and where the arm was in every tick."""
        dt, posture = self.given.dt, kind == "posture"
        motion = ftqp.GoTo(self.planner(), **({"q": self.goal} if posture else {"pose": self.pose}))
        rows, longest, stood, moved = gone(motion, self.start, dt, *lock)
        said = motion.status is ftqp.GoToStatus.REACHED
        off = self.independent.errors(rows[-1][None], self.pose)[0][0]
        there = (
            np.linalg.norm(off[:3]) < 1.01 * TOLERANCES[0] and np.linalg.norm(off[3:]) < 1.01 * TOLERANCES[1]
        )
        row = {
            "reached": said, "false": said and not there, "moved": moved > 1e-9,
            "least": self.judge.least(self.things, rows[:: max(1, round(0.02 / dt))]),
            "time": len(rows) * dt, "longest": longest, "sentence": motion.sentence,
            "stood": rows[stood or 0],
            "jerk": (np.abs(np.diff(rows, n=3, axis=0)) / dt**3 / (self.robot.limits.a_max / RISE)).max(),
        }  # fmt: skip
        return row, rows

    def solved(self, at, lock, starts):
        """What the oracle says of the pose from a posture, with a joint locked."""
        oracle = MeshOracle(self.independent, self.judge, self.things, self.given.keep)
        return oracle.solves(at, self.pose, [lock], starts, TOLERANCES)


def told(kind, rows):
    """A line of the table."""
    time = np.percentile([row["time"] for row in rows if row["reached"]] or [0.0], [50, 95])
    line = f"{kind:26s} reached {sum(row['reached'] for row in rows)} of {len(rows)}"
    if "solved" in rows[0]:
        solved = [row for row in rows if row["solved"] == "yes"]
        line += (
            f", of those that the oracle solves {sum(row['reached'] for row in solved)} of {len(solved)}, "
            f"of the others {sum(row['reached'] for row in rows) - sum(row['reached'] for row in solved)}"
        )
    print(
        f"{line}; touches {sum(row['least'] <= 0.0 for row in rows)}, least distance by meshes "
        f"{1e3 * min(row['least'] for row in rows):.1f} mm; false {sum(row['false'] for row in rows)}, "
        f"locked joints moved {sum(row['moved'] for row in rows)}; jerk beyond a_max/T in "
        f"{sum(row['jerk'] > 1.02 for row in rows)}, up to {max(row['jerk'] for row in rows):.1f} times; "
        f"there in {time[0]:.1f} {time[1]:.1f} s"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="every fifth problem")
    parser.add_argument("--keep", type=float, default=0.002, help="the clearance that is kept [m]")
    parser.add_argument("--dt", type=float, default=0.004, help="the tick [s]")
    parser.add_argument("--starts", type=int, default=1000, help="of the oracle's inverse kinematics")
    parser.add_argument("--locks", choices=["all", "none", *LOCKS], default="all")
    given = parser.parse_args()
    judge = Judge()
    robot = judge.arm()
    arm = robot, judge, IndependentArm(robot)
    found = {kind: [] for kind in ("posture", "pose", *LOCKS)}
    ways = {"posture": [], "pose": []}
    problems = json.loads(PROBLEMS.read_text())[:: 5 if given.quick else 1]
    for number, problem in enumerate(problems):
        trial = Trial(arm, problem, given)
        for kind in ("posture", "pose"):
            goal = {"goals": [trial.goal]} if kind == "posture" else {"goal": trial.pose}
            ways[kind].append(searched(trial.planner(), trial.start, **goal))
            row, gone_by = trial.goes(kind)
            found[kind].append(row)
            if not row["reached"]:
                print(f"{kind} {trial.name}: {row['sentence']}", flush=True)
        half = len(gone_by) // 2
        one = number % robot.nv
        cases = [(LOCKS[0], lock, 0, "instant") for lock in range(robot.nv)]
        cases += [(LOCKS[1], one, half, "ramp"), (LOCKS[2], one, half, "instant")]
        for kind, lock, after, mode in cases:
            if given.locks not in ("all", kind):
                continue
            row, _ = trial.goes("pose", lock, after, mode)
            row["solved"] = trial.solved(row["stood"], lock, given.starts)
            found[kind].append(row)
            if (
                row["reached"] != (row["solved"] == "yes")
                or row["false"]
                or row["moved"]
                or row["least"] <= 0.0
            ):
                print(
                    f"{trial.name}, joint {lock + 1} {kind}: oracle {row['solved']}, least "
                    f"{1e3 * row['least']:.1f} mm: {row['sentence']}",
                    flush=True,
                )
    print(f"keep {1e3 * given.keep:g} mm, dt {1e3 * given.dt:g} ms; median and 95 %")
    for kind, rows in found.items():
        if rows:
            told(kind, rows)
    for kind, rows in ways.items():
        first = 1e3 * np.percentile([row for row in rows if row is not None], [50, 95], axis=0)
        print(
            f"search for a {kind}: first way {first[0, 0]:.1f} {first[1, 0]:.1f} ms, motion "
            f"{first[0, 1]:.1f} {first[1, 1]:.1f} ms of the processor"
        )


if __name__ == "__main__":
    main()
