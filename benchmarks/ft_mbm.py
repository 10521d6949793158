"""Goals of MotionBenchMaker's Panda among boxes and cylinders, gone to by ``ftqp.GoTo`` and judged by meshes.

Each problem is a start, a goal posture and a scene; the goal is taken as a posture, and as the pose of the
tip there; then, of every fourth, as the pose with each joint locked at the start, with one that brakes
half-way, and with one that stops dead there. An ideal arm goes where it is told. The true meshes, measured by
coal every 20 ms, say how near it came, and an oracle that shares nothing with ftqp whether the pose can be
reached with that lock at all. Problems and their licence: benchmarks/problems.

Beside it roboplan's and OMPL's RRT-Connect look for ways to the same postures, in environments of their own,
question by question in turn with ftqp's search; to a pose with a lock they get the oracle's posture. Damped
least squares, told of the lock, go straight.
"""

import argparse
import json
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from peers.asked_ways import OMPL, ROBOPLAN, AskedPlanner
from peers.independent_arm import IndependentArm
from peers.mesh_oracle import MeshOracle
from peers.true_meshes import BOX, Judge, things_of
from steps.environments import DEFAULT, NotInstalled

import ftqp
from ftqp.control.planner.ways.ways import Ways
from ftqp.model.collision_geometry import around

PROBLEMS = Path(__file__).parent / "problems/motion_bench_maker.json"
TOLERANCES = 1e-3, 5e-3
LOCKS = "locked at the start", "brakes half-way", "stops dead half-way"
LONGEST, RISE = 40.0, 0.05
LOOKS = 50
ASKED = "to a posture", "with a lock"
JUDGED = 0.02
"""Ways are judged in places so far apart [rad]."""


def arm_of(judge):
    """The Panda of the catalog, its bodies those of the meshes."""
    bodies = []
    for name, one in zip(judge.names, judge.bodies, strict=True):
        T = one.placement
        corners = np.array(one.geometry.vertices()) @ T.rotation.T + T.translation
        frame = f"panda_joint{one.parentJoint}" if one.parentJoint else "universe"
        bodies += [
            ftqp.Capsule(a, b, r + 1e-5, frame=frame, name=name, corners=inside)
            for a, b, r, inside in around(corners)
        ]
    return ftqp.robots.load("panda").with_capsules(bodies)


def scene_of(problem, things):
    """What is around, for ftqp."""
    scene = ftqp.Scene()
    for k, ((kind, *row), (_, T)) in enumerate(zip(problem["bodies"], things, strict=True)):
        place, size = np.eye(4), np.array(row[6:])
        place[:3, :3], place[:3, 3] = T.getRotation(), T.getTranslation()
        body = ftqp.Box(2.0 * size, place) if kind == BOX else ftqp.Cylinder(size[1], 2.0 * size[0], place)
        scene.add(f"thing {k}", body)
    return scene


def searched(planner, start, **goal):
    """The places of the first way, or None, and the seconds of the processor until it and its motion."""
    t = process_time()
    ways = Ways(planner, start, **goal)
    while ways.is_searching and not ways.has_way:
        ways.search_step(LOOKS)
    first, places = process_time() - t, ways.way if ways.has_way else None
    while ways.is_searching:
        ways.search_step(LOOKS)
    return places, first, process_time() - t


def straight(arm, start, pose, lock, dt):
    """Where damped least squares go, (ticks, n), at 1 rad/s at most and within the range."""
    q, free, rows = start.copy(), np.arange(arm.n) != lock, [start]
    for _ in range(round(LONGEST / dt)):
        e, J = (one[0] for one in arm.errors(q[None], pose))
        if np.linalg.norm(e[:3]) < TOLERANCES[0] and np.linalg.norm(e[3:]) < TOLERANCES[1]:
            break
        A = J * free
        v = A.T @ np.linalg.solve(A @ A.T + 4e-4 * np.eye(6), 2.0 * e)
        q = np.clip(q + dt * v / max(1.0, np.abs(v).max()), arm.low, arm.high)
        rows.append(q)
        if np.abs(q - rows[-2]).max() < 1e-7:
            break
    return np.array(rows)


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
        self.bodies, self.things = problem["bodies"], things_of(problem["bodies"])
        self.scene = scene_of(problem, self.things)
        self.pose = self.robot.pose(self.goal)

    def planner(self, *faults):
        """A planner at the start."""
        clearance = ftqp.Clearance(keep=self.given.keep, stop=0.0)
        planner = ftqp.Planner(self.robot, self.given.dt, scene=self.scene, clearance=clearance)
        planner.reset(self.start)
        for fault in faults:
            planner.report(fault)
        return planner

    def ways(self, peers, posture, **lock):
        """What each search finds: seconds, the length of the way and its least distance, by name."""
        failed = list(lock.values())
        goal = {"goal": self.pose, "tolerance": TOLERANCES} if failed else {"goals": [posture]}
        faults = [ftqp.Locked(joint, mode="instant") for joint in failed]
        asked = {"ftqp": lambda: searched(self.planner(*faults), self.start, **goal)}
        for name, peer in peers.items():
            asked[name] = lambda peer=peer: peer.ask(self.bodies, self.start, posture, failed)
        found = {}
        for name, ask in asked.items():
            places, *seconds = ask()
            found[name] = {"seconds": seconds, "least": None, "length": None}
            if places is not None:
                steps = np.diff(places, axis=0)
                found[name]["length"] = np.linalg.norm(steps, axis=1).sum()
                found[name]["least"] = self.judge.least(self.things, between(places))
        return found

    def straight(self, lock=None):
        """What comes of damped least squares."""
        rows = straight(self.independent, self.start, self.pose, -1 if lock is None else lock, 0.02)
        off = self.independent.errors(rows[-1][None], self.pose)[0][0]
        reached = np.linalg.norm(off[:3]) < TOLERANCES[0] and np.linalg.norm(off[3:]) < TOLERANCES[1]
        return {"reached": bool(reached), "least": self.judge.least(self.things, rows)}

    def goes(self, kind, *lock):
        """What comes of ``GoTo``, see ``gone``: a row of the table, and where the arm was in every tick."""
        dt, posture = self.given.dt, kind == "posture"
        goal = {"q": self.goal} if posture else {"pose": self.pose}
        try:
            motion = ftqp.GoTo(self.planner(), **goal)
        except ftqp.InputError as refused:  # a goal posture that is out of range
            return {"sentence": str(refused)}, self.start[None]
        rows, longest, stood, moved = gone(motion, self.start, dt, *lock)
        said = motion.status is ftqp.GoToStatus.REACHED
        off = self.independent.errors(rows[-1][None], self.pose)[0][0]
        there = (
            np.linalg.norm(off[:3]) < 1.01 * TOLERANCES[0] and np.linalg.norm(off[3:]) < 1.01 * TOLERANCES[1]
        )
        jerk = np.abs(np.diff(rows, n=3, axis=0)) / dt**3 / (self.robot.limits.a_max / RISE)
        row = {
            "reached": said, "false": said and not there, "moved": moved > 1e-9,
            "least": self.judge.least(self.things, rows[:: max(1, round(0.02 / dt))]),
            "keep": self.given.keep, "time": len(rows) * dt, "longest": longest, "sentence": motion.sentence,
            "stood": rows[stood or 0],
            "jerk": np.delete(jerk, lock[:1], axis=1).max(),
        }  # fmt: skip
        return row, rows

    def solved(self, at, lock, starts):
        """What the oracle says of the pose from a posture, with a joint locked."""
        oracle = MeshOracle(self.independent, self.judge, self.things, self.given.keep)
        return oracle.solves(at, self.pose, [lock], starts, TOLERANCES), oracle.found


def between(places):
    """Places of a way, close together."""
    rows = [places[:1]]
    for a, b in pairwise(places):
        count = max(1, int(np.ceil(np.abs(b - a).max() / JUDGED)))
        rows.append(a + np.arange(1, count + 1)[:, None] / count * (b - a))
    return np.concatenate(rows)


def told(kind, rows):
    """A line of the table of motions."""
    time = np.percentile([row["time"] for row in rows if row["reached"]] or [0.0], [50, 95])
    line = f"{kind:26s} reached {sum(row['reached'] for row in rows)} of {len(rows)}"
    if "solved" in rows[0]:
        line += among_solved(rows)
    print(
        f"{line}; touches {sum(row['least'] <= 0.0 for row in rows)}, nearer than is kept "
        f"{sum(row['least'] < row['keep'] for row in rows)}, least distance by meshes "
        f"{1e3 * min(row['least'] for row in rows):.1f} mm; false {sum(row['false'] for row in rows)}, "
        f"locked joints moved {sum(row['moved'] for row in rows)}; jerk beyond a_max/T in "
        f"{sum(row['jerk'] > 1.02 for row in rows)}, up to {max(row['jerk'] for row in rows):.1f} times; "
        f"there in {time[0]:.1f} {time[1]:.1f} s"
    )


def among_solved(rows):
    """How many of those that the oracle solves were reached, and how many others."""
    solved = [row for row in rows if row["solved"] == "yes"]
    there = sum(row["reached"] for row in solved)
    return (
        f", of those that the oracle solves {there} of {len(solved)}, "
        f"of the others {sum(row['reached'] for row in rows) - there}"
    )


def told_ways(kind, rows):
    """Lines of the table of searches: every peer, and how it compares with ftqp on the same problems."""
    ways = [row["ftqp"] for row in rows if row["ftqp"]["length"] is not None]
    own = np.percentile([one["seconds"][0] for one in ways], [50, 95])
    for name in rows[0]:
        found = [row[name] for row in rows]
        done = [one for one in found if one["length"] is not None]
        first = np.percentile([one["seconds"][0] for one in done], [50, 95])
        line = (
            f"way {kind}, {name:9s} found {len(done)} of {len(found)}; first way {1e3 * first[0]:.1f} "
            f"{1e3 * first[1]:.1f} ms of the processor"
        )
        if name == "ftqp":
            ready = 1e3 * np.percentile([one["seconds"][1] for one in done], [50, 95])
            line += f", motion {ready[0]:.1f} {ready[1]:.1f} ms"
        else:
            line += f", {first[0] / own[0]:.2f} and {first[1] / own[1]:.2f} times ftqp's"
        print(
            f"{line}; {np.median([one['length'] for one in done]):.1f} rad; touches "
            f"{sum(one['least'] <= 0.0 for one in done)}, least distance by meshes "
            f"{1e3 * min(one['least'] for one in done):.1f} mm"
        )


def told_straight(kind, rows):
    """A line of damped least squares."""
    line = f"{kind:26s} damped least squares reached {sum(row['reached'] for row in rows)} of {len(rows)}"
    if "solved" in rows[0]:
        line += among_solved(rows)
    clear = sum(row["reached"] and row["least"] > 0.0 for row in rows)
    print(f"{line}; without a touch {clear}; touches {sum(row['least'] <= 0.0 for row in rows)}")


def peers_of(given):
    """The planners that run beside, by name; one that is missing is told in a sentence."""
    found = {}
    for peer in (ROBOPLAN, OMPL):
        if peer.name in given.peers.split(","):
            try:
                found[peer.name] = AskedPlanner(peer, given.environments)
                print(f"{peer.name}: {found[peer.name].versions}", flush=True)
            except NotInstalled as error:
                print(f"left out: {error}", flush=True)
    return found


class Tables:
    """What came of motions, of damped least squares and of searches, by kind.

    Args:
        given: The arguments of the script.
        peers: The planners that run beside.
    """

    def __init__(self, given, peers):
        self.given, self.peers = given, peers
        self.found = {kind: [] for kind in ("posture", "pose", *LOCKS)}
        self.straight = {"pose": [], LOCKS[0]: []}
        self.ways = {kind: [] for kind in ASKED}

    def healthy(self, trial):
        """Both goals of a problem; how many ticks the motion to the pose has."""
        self.ways[ASKED[0]].append(trial.ways(self.peers, trial.goal))
        self.straight["pose"].append(trial.straight())
        for kind in ("posture", "pose"):
            row, gone_by = trial.goes(kind)
            if "reached" not in row:
                print(f"{kind} {trial.name} refused: {row['sentence']}", flush=True)
                continue
            self.found[kind].append(row)
            if not row["reached"] or row["false"] or row["least"] <= 0.0:
                print(f"{kind} {trial.name}, {1e3 * row['least']:.1f} mm: {row['sentence']}", flush=True)
        return len(gone_by)

    def locked(self, trial, half, one):
        """Its pose with each joint locked at the start, and with one that locks half-way."""
        cases = [(LOCKS[0], lock, 0, "instant") for lock in range(trial.robot.nv)]
        cases += [(LOCKS[1], one, half, "ramp"), (LOCKS[2], one, half, "instant")]
        for kind, lock, after, mode in cases:
            if self.given.locks not in ("all", kind):
                continue
            row, _ = trial.goes("pose", lock, after, mode)
            row["solved"], posture = trial.solved(row["stood"], lock, self.given.starts)
            self.found[kind].append(row)
            solved = row["solved"] == "yes"
            if kind == LOCKS[0]:
                self.straight[kind].append({**trial.straight(lock), "solved": row["solved"]})
                if solved:
                    self.ways[ASKED[1]].append(trial.ways(self.peers, posture, lock=lock))
            if row["reached"] != solved or row["false"] or row["moved"] or row["least"] <= 0.0:
                print(
                    f"{trial.name}, joint {lock + 1} {kind}: oracle {row['solved']}, least "
                    f"{1e3 * row['least']:.1f} mm: {row['sentence']}",
                    flush=True,
                )

    def tell(self):
        """Print all lines."""
        print(f"keep {1e3 * self.given.keep:g} mm, dt {1e3 * self.given.dt:g} ms; median and 95 %")
        for tell, table in ((told, self.found), (told_straight, self.straight), (told_ways, self.ways)):
            for kind, rows in table.items():
                if rows:
                    tell(kind, rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, epilog="Ctrl-C ends it with what there is.")
    parser.add_argument("--quick", action="store_true", help="every twentieth problem")
    parser.add_argument("--keep", type=float, default=0.002, help="the clearance that is kept [m]")
    parser.add_argument("--dt", type=float, default=0.004, help="the tick [s]")
    parser.add_argument("--starts", type=int, default=1000, help="of the oracle's inverse kinematics")
    parser.add_argument("--locks", choices=["all", "none", *LOCKS], default="all")
    parser.add_argument("--peers", default="roboplan,ompl", help="planners that run beside; empty: none")
    parser.add_argument("--environments", type=Path, default=DEFAULT, help="where those of peers are")
    given = parser.parse_args()
    judge, peers = Judge(), peers_of(given)
    robot = arm_of(judge)
    arm, tables = (robot, judge, IndependentArm(robot)), Tables(given, peers)
    problems = json.loads(PROBLEMS.read_text())[:: 20 if given.quick else 1]
    every = 1 if given.quick else 4
    first = Trial(arm, problems[0], given)
    searched(first.planner(), first.start, goals=[first.goal])  # what is loaded once
    with suppress(KeyboardInterrupt):
        for number, problem in enumerate(problems):
            trial = Trial(arm, problem, given)
            ticks = tables.healthy(trial)
            if number % every == 0:
                tables.locked(trial, ticks // 2, number // every % robot.nv)
    tables.tell()
    for peer in peers.values():
        peer.close()


if __name__ == "__main__":
    main()
