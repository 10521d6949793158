"""Fewer rows: paths whose end has no posture for the whole pose after a lock, and one for the position.

    python benchmarks/bench_fewer_rows.py           30 paths for each of two arms
    python benchmarks/bench_fewer_rows.py --quick   6

An arm (Panda, iiwa14) follows a line of 0.1 to 0.4 m and up to 0.6 rad from a random posture; a random
joint is locked from the beginning. Kept are paths at whose end ``ftqp.postures`` finds none for the pose in
480 starts, and one for the position. Each is followed by the clock and by progress, with all rows and with
``degrade`` for all sets: finished is a tip within 2 mm of the end. Then the joint is repaired, and the
tip has to come back to the whole pose.
"""

import os
import sys

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import docs  # noqa: E402
from bench.tables import Table  # noqa: E402

import ftqp  # noqa: E402
from ftqp.core.pose import rotation_exp, rotation_vector  # noqa: E402

ARMS = ("panda", "iiwa14")
SEED, DT, THERE, TURNED, REST = 20261201, 4e-3, 2e-3, 0.02, 6.0
FASTEST, FASTEST_TURN = 0.25, 0.75
LIMITATIONS = (
    "That no posture is found in 480 starts is no proof that there is none.",
    "Arms follow their commands; no obstacles; the joint is locked from the beginning.",
)


def drawn(arm: str, k: int):
    """A start, a path and a locked joint with a position at the end and no pose."""
    robot = ftqp.robots.load(arm)
    low, high = robot.limits.q_min, robot.limits.q_max
    generator = np.random.default_rng([SEED, ARMS.index(arm), k])
    while True:
        q = generator.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
        way, spin = (generator.standard_normal(3) for _ in range(2))
        goal, joint = robot.pose(q), int(generator.integers(robot.nv))
        far, angle = generator.uniform(0.1, 0.4), generator.uniform(0.0, 0.6)
        goal[:3, 3] += far * way / np.linalg.norm(way)
        goal[:3, :3] = rotation_exp(angle * spin / np.linalg.norm(spin)) @ goal[:3, :3]
        lock = ftqp.Locked(joint, mode="instant")
        if len(ftqp.postures(robot, goal, faults=lock, near=q, count=1)):
            continue
        if len(ftqp.postures(robot, goal, faults=lock, near=q, count=1, rows="position")):
            duration = max(2.0, 1.875 * far / FASTEST, 1.875 * angle / FASTEST_TURN)
            return robot, q, ftqp.paths.PointToPoint(robot.pose(q), goal, duration=duration), joint


def off(robot, q, pose):
    """How far the tip is from a pose [m, rad]."""
    T = robot.pose(q)
    turn = rotation_vector(pose[:3, :3] @ T[:3, :3].T)
    return float(np.linalg.norm(pose[:3, 3] - T[:3, 3])), float(np.linalg.norm(turn))


def followed(robot, q, path, joint: int, *, progress: bool, degrade):
    """Where the tip ends, and whether it comes back to the whole pose after a repair."""
    task = ftqp.Task(mode="scaled" if progress else "slack", degrade=degrade)
    planner = ftqp.Planner(robot, DT, task=task, emergency=None)
    planner.reset(q)
    planner.report(ftqp.Locked(joint, mode="instant"))
    leader = ftqp.PathFollower(planner, path) if progress else None
    v, end = np.zeros(robot.nv), path.sample([path.duration]).pose[0]
    target = ftqp.Target(pose=path.start)

    def step(k: int):
        if leader is not None:
            return leader.step(q, v)
        sample = path.sample([min(k * DT, path.duration)])
        target.pose[:], moves = sample.pose[0], k * DT < path.duration
        target.twist[:], target.acceleration[:] = moves * sample.twist[0], moves * sample.acceleration[0]
        return planner.step(q, v, target)

    count = round((path.duration + REST) / DT)
    for k in range(count):
        made = step(k)
        q, v = made.reference.q.copy(), made.reference.v.copy()
    position, _ = off(robot, q, end)
    planner.withdraw(joint)
    if leader is not None:
        leader.resume()
    for k in range(count, count + round(2.0 * REST / DT)):
        made = step(k)
        q, v = made.reference.q.copy(), made.reference.v.copy()
    again = off(robot, q, end)
    back = again[0] < THERE and again[1] < TURNED
    return position, back, planner.given_up is None


def main() -> int:
    """Draw, follow, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, "6 paths for each arm", paths=(30, "for each arm"))
    count = 6 if options.quick else options.paths
    rows = []
    for arm in ARMS:
        cases = [drawn(arm, k) for k in range(count)]
        for progress in (False, True):
            for name, degrade in (("all rows", ()), ("fewer rows", ("pose", "position_axis", "position"))):
                done = [followed(*case, progress=progress, degrade=degrade) for case in cases]
                back = [one for one in done if one[1]]
                rows.append({
                    "arm": arm, "leader": "progress" if progress else "clock", "rows": name, "paths": count,
                    "finished": sum(one[0] < THERE for one in done),
                    "off": 1e3 * float(np.median([one[0] for one in done])),
                    "back": len(back), "whole": sum(one[2] for one in back),
                })  # fmt: skip
    result = docs.measured("bench_fewer_rows", {"paths": count, "seed": SEED, "dt": DT}, rows, LIMITATIONS)
    lines = [
        (r["arm"], r["leader"], r["rows"], f"{r['finished']} of {r['paths']}", f"{r['off']:.2g}",
         str(r["back"]), str(r["whole"]))
        for r in rows
    ]  # fmt: skip
    headings = (
        "arm", "led by", "rows", "end within 2 mm", "off, p50 [mm]", "pose reached after a repair",
        "of these with all rows",
    )  # fmt: skip
    table = Table(title="Paths without a pose at their end", headings=headings, rows=lines)
    docs.publish(result, "Fewer rows after a lock", [table], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
