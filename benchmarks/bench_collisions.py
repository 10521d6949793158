"""Motions past a ball that stands in the way: ftqp beside pink and mink with their own collision avoidance.

    python benchmarks/bench_collisions.py            24 motions of a healthy Panda, 24 with a joint locked
    python benchmarks/bench_collisions.py --cases 4
    python benchmarks/bench_collisions.py --env-dir DIR   where pink and mink are, or are installed

The tip of a Panda follows a line of 0.25 to 0.4 m; a ball stands on it, or up to 6 cm beside its middle, so
that the straight way leads into it. Every program gets the same capsules, ball, limits, dt, targets and
distance to keep, wired as its own examples show. Distances are measured afterwards, all in the same way.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402
from bench import command_line, docs  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402
from peers.motion_case import MotionCase  # noqa: E402
from peers.run_script import run_script  # noqa: E402
from steps.environments import DEFAULT, NotInstalled  # noqa: E402

import ftqp  # noqa: E402

HERE = Path(__file__).resolve().parent
SEED, DT, KEEP, REST = 20261126, 4e-3, 0.02, 3.0
FASTEST = 0.25
PROGRAMS = {
    "ftqp, velocity": ("with_ftqp", "velocity", None),
    "ftqp, acceleration": ("with_ftqp", "acceleration", None),
    "pink": ("with_pink", "", "pink"),
    "mink": ("with_mink", "", "mink"),
}
ARRIVED = 5e-3
"""A goal counts as reached within this [m]."""
LIMITATIONS = (
    "Peers are wired by us after their examples; gains other than those of the examples were not tried.",
    "pink and mink bound velocities; only ftqp at the acceleration level bounds accelerations, too.",
    "The ball stands still, and arms follow their commands.",
)


def drawn(robot, lock: bool, k: int) -> MotionCase:
    """A motion that leads into a ball unless something is done."""
    rng = np.random.default_rng([SEED, int(lock), k])
    low, high = robot.limits.q_min, robot.limits.q_max
    rods = rods_of(robot)
    while True:
        q = rng.uniform(low + 0.2 * (high - low), high - 0.2 * (high - low))
        start = robot.pose(q)
        way = rng.standard_normal(3)
        way *= rng.uniform(0.25, 0.4) / np.linalg.norm(way)
        goal = start.copy()
        goal[:3, 3] += way
        aside = rng.standard_normal(3) * 0.02
        radius = rng.uniform(0.04, 0.07)
        ball = np.array([*(start[:3, 3] + rng.uniform(0.45, 0.6) * way + aside), radius])
        reach = np.linalg.norm(goal[:3, 3] - [0.0, 0.0, 0.33])
        if reach > 0.7 or goal[2, 3] < 0.1 or np.linalg.norm(goal[:3, 3] - ball[:3]) < radius + 0.13:
            continue
        if distance(robot, rods, q[None], ball) > 0.05:
            break
    limits = [low, high, robot.limits.v_max, robot.limits.a_max]
    size = float(np.linalg.norm(way))
    return MotionCase(
        kind="goal", arm="panda", urdf=robot.to_urdf(), tip=robot.tip, joints=list(robot.joints),
        locked=int(rng.integers(robot.nv)) if lock else -1, dt=DT, q=q.tolist(), start=start.tolist(),
        goal=goal.tolist(), duration=1.875 * size / FASTEST, rest=REST,
        limits=[row.tolist() for row in limits], rods=rods, balls=[ball.tolist()], keep=KEEP,
    )  # fmt: skip


def rods_of(robot) -> list:
    """The capsules that move, each in the frame of its joint."""
    found = []
    for one in robot.capsules:
        frame = robot.model.frames[robot.model.getFrameId(one.frame)] if one.frame != "universe" else None
        if frame is None:
            continue
        a, b = (frame.placement.act(end) for end in (one.a, one.b))
        found.append([int(frame.parentJoint) - 1, *map(float, a), *map(float, b), one.radius])
    return found


def distance(robot, rods, q, ball) -> float:
    """The least distance of the arm from a ball over a motion [m]."""
    least = np.inf
    for posture in q:
        for joint, *rest in rods:
            T = robot.pose(posture, robot.joints[joint])
            a, b = (T[:3, :3] @ np.array(end) + T[:3, 3] for end in (rest[:3], rest[3:6]))
            way = b - a
            s = np.clip((ball[:3] - a) @ way / max(way @ way, 1e-12), 0.0, 1.0)
            least = min(least, float(np.linalg.norm(a + s * way - ball[:3])) - rest[6] - ball[3])
    return least


def main() -> int:
    """Draw, run, measure, print, write; 0 when done, 2 for bad input."""
    options = _options()
    robot = ftqp.robots.load("panda")
    versions, left_out, rows = {}, {}, []
    with tempfile.TemporaryDirectory() as folder:
        for lock in (False, True):
            cases = [drawn(robot, lock, k) for k in range(options.cases)]
            straight = [
                distance(robot, case.rods, along(robot, case), np.array(case.balls[0])) for case in cases
            ]
            for name in PROGRAMS:
                try:
                    q, us, failed, found = run_script(*PROGRAMS[name], cases, Path(folder), options.env_dir)
                except NotInstalled as error:
                    left_out[name] = str(error)
                    continue
                versions |= found
                rows.append(
                    _row(robot, name, lock, cases, q, us, failed, int(sum(d < 0.0 for d in straight)))
                )
    result = docs.measured(
        "bench_collisions", {"cases": options.cases, "seed": SEED, "dt": DT, "keep": KEEP}, rows, LIMITATIONS
    )
    result["versions"] |= versions
    result["left_out"] |= left_out
    docs.publish(
        result, "Past a ball, beside pink and mink", [_table(lock, rows) for lock in (False, True)], options
    )
    return 0


def along(robot, case):
    """Postures of a healthy arm that knows of no ball, every 0.1 s."""
    planner = ftqp.Planner(robot, case.dt, level="velocity", emergency=None)
    q, kept = np.array(case.q), []
    planner.reset(q)
    poses, twists = case.targets()
    for k in range(case.steps):
        q = planner.step(q, None, ftqp.Target(pose=poses[k], twist=twists[k])).q.copy()
        if k % 25 == 0:
            kept.append(q)
    return kept


def _row(robot, name, lock, cases, q, us, failed, into) -> dict[str, object]:
    near = [
        distance(robot, case.rods, one[::2], np.array(case.balls[0]))
        for case, one in zip(cases, q, strict=True)
    ]
    ends = [
        np.linalg.norm(robot.pose(one[-1])[:3, 3] - np.array(case.goal)[:3, 3])
        for case, one in zip(cases, q, strict=True)
    ]
    whole = [len(one) == case.steps + 1 for case, one in zip(cases, q, strict=True)]
    return {
        "program": name, "lock": lock, "cases": len(cases), "straight_into": into,
        "least": 1e3 * float(np.min(near)), "touched": int(sum(d < 0.0 for d in near)),
        "below": int(sum(d < KEEP - 1e-3 for d in near)),
        "reached": sum(bool(w and e <= ARRIVED) for w, e in zip(whole, ends, strict=True)),
        "off": 1e3 * float(np.median(ends)), "raised": sum(map(bool, failed)),
        "why": sorted({str(why) for why in failed if why})[:3], "us": float(np.median(us)),
    }  # fmt: skip


def _table(lock, rows) -> Table:
    lines = [
        (r["program"], f"{r['least']:.1f}", str(r["touched"]), str(r["below"]),
         f"{r['reached']} of {r['cases']}", quantity(r["off"]), str(r["raised"]), quantity(r["us"]))
        for r in rows if r["lock"] == lock
    ]  # fmt: skip
    headings = (
        "program", "nearest [mm]", "touched", "1 mm below keep", "goal within 5 mm", "off at the end [mm]",
        "raised", "tick [us]",
    )  # fmt: skip
    of = next(r for r in rows if r["lock"] == lock)
    notes = (
        f"{of['cases']} motions, {of['straight_into']} of which lead into the ball when nobody looks; every "
        f"program was asked to keep {1e3 * KEEP:g} mm; 'off' and 'tick' are medians.",
    )
    title = "A Panda with a joint locked from the beginning" if lock else "A healthy Panda"
    return Table(title=title, headings=headings, rows=lines, notes=notes)


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    add("--cases", type=command_line.at_least_one, default=24, metavar="N", help="of each table (default 24)")
    add("--env-dir", type=Path, default=DEFAULT, metavar="DIR", help=f"of pink and mink (default {DEFAULT})")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
