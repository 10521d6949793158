"""Motions after a lock: ftqp beside damped least squares, placo and pink, and what an oracle calls feasible.

    python benchmarks/compare_peers.py           50 paths and 50 goals for each of four arms
    python benchmarks/compare_peers.py --quick   6 and 6, in two minutes
    python benchmarks/compare_peers.py --env-dir DIR   where placo and pink are, or are installed

An arm (Panda, iiwa14, xarm7, or a chain of 7 joints drawn at random) stands at a random posture that is
neither near a singularity nor at limits; a random joint is locked there. The tip is to go along a line, 0.1
to 0.4 m and up to 0.6 rad with a quintic law, as a path, or to a random pose, as a goal. The oracle is
damped least squares in numpy with 1,000 restarts, and follows the line in 400 steps: it says whether the
line can be followed by the joints left within limits (straight) or from another posture of its start (from
another posture), whether only its end has a posture (end only; other posture, of goals), or that nothing is
known. Every program gets the same URDF, limits, dt and targets, wired as its
own documentation shows, and does what it is told. All rows are published, also where another program is as
good or better.
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
from bench.results import circumstances  # noqa: E402
from bench.tables import Table, quantity  # noqa: E402
from peers.independent_arm import IndependentArm  # noqa: E402
from peers.motion_case import MotionCase, turn, vector_of  # noqa: E402
from peers.run_script import run_script  # noqa: E402
from steps.environments import DEFAULT, NotInstalled  # noqa: E402

import ftqp  # noqa: E402

HERE = Path(__file__).resolve().parent
ARMS = ("panda", "iiwa14", "xarm7", "random chain")
KINDS = ("path", "goal")
CLASSES = {
    "path": ("straight", "from another posture", "end only", "not known"),
    "goal": ("straight", "other posture", "not known"),
}
SEED, DT, GOAL_TIME, REST = 20261128, 4e-3, 12.0, 2.0
FASTEST, FASTEST_TURN = 0.25, 0.75
PROGRAMS = {
    "ftqp step": ("path", "with_ftqp", "step", None),
    "ftqp PathFollower": ("path", "with_ftqp", "follower", None),
    "ftqp PathFollower, bridges": ("path", "with_ftqp", "bridges", None),
    "ftqp GoTo": ("goal", "with_ftqp", "ways", None),
    "ftqp GoTo, straight": ("goal", "with_ftqp", "straight", None),
    "damped least squares": ("path goal", "with_dls", "", None),
    "placo": ("path goal", "with_placo", "", "placo"),
    "pink": ("path goal", "with_pink", "plain", "pink"),
    "pink, AccelerationLimit": ("path goal", "with_pink", "accelerations", "pink"),
}
"""For which kinds, which script and way, and whose environment; None is this one."""
SEEDS, EACH, DISTINCT = 40, 10, 0.05
"""Postures of a start are looked for so many times in so many restarts; they differ by so much [rad]."""
ON_LINE, ARRIVED, TURNED, STILL = 2e-3, 1e-3, 1e-2, 1e-3
"""A path is finished if the tip was never farther off than the first [m] and 0.02 rad and ends within the
others [m, rad]; at rest is slower than the last share of the speed limits."""
TURNED_ON_LINE, LET_PASS, PLACES = 2e-2, 1.0 + 1e-3, 100
"""The last: places of a line that are to be passed in order by a tip that may leave it between them."""
LIMITATIONS = (
    "The joint is locked from the beginning, so that every program continues from the same posture.",
    "The oracle's 'other posture' and 'end only' say that the end has one, not that there is a way; 'from "
    "another posture' says that the line can be followed from there; the rest is unknown.",
    "Peers are wired by us; none of them claims to look for another posture.",
    "pink's limits are hard: where it finds no velocity within all of them it raises NoSolutionFound.",
    "No obstacles; arms follow their commands; accelerations are differences of the commanded joints.",
)


def random_chain(seed: int):
    """A robot of 7 joints with axes and lengths drawn at random; 150 degrees, 2 rad/s, 10 rad/s2."""
    generator = np.random.default_rng([SEED, seed])
    twist = np.deg2rad(90.0) * generator.choice([-1.0, 1.0], 7)
    table = [(0.0, d, a, alpha) for d, a, alpha in zip(
        generator.uniform(0.05, 0.3, 7), generator.uniform(0.0, 0.1, 7), twist, strict=True
    )]  # fmt: skip
    bend = np.deg2rad(150.0)
    limits = {"q_min": -bend, "q_max": bend, "v_max": 2.0, "a_max": 10.0}
    return ftqp.Robot.from_dh(table, name=f"chain{seed}", limits=limits)


def drawn(name: str, kind: str, k: int):
    """A case without the oracle's word; its robot and its independent arm."""
    robot = random_chain(k) if name == "random chain" else ftqp.robots.load(name)
    arm = IndependentArm(robot)
    generator = np.random.default_rng([SEED, ARMS.index(name), KINDS.index(kind), k])
    low, high = robot.limits.q_min, robot.limits.q_max
    while True:
        q = generator.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
        J = arm.poses(q[None])[2][0] * np.array([1.0, 1.0, 1.0, *3 * [robot.length]])[:, None]
        if np.linalg.svd(J, compute_uv=False)[-1] > 0.3 * robot.length:
            break
    locked = int(generator.integers(robot.nv))
    start = goal = robot.pose(q)
    goal = goal.copy()
    if kind == "path":
        way, spin = (generator.standard_normal(3) for _ in range(2))
        goal[:3, 3] += generator.uniform(0.1, 0.4) * way / np.linalg.norm(way)
        goal[:3, :3] = turn(generator.uniform(0.0, 0.6) * spin / np.linalg.norm(spin)) @ goal[:3, :3]
    else:
        goal = robot.pose(generator.uniform(low, high))
    size = np.linalg.norm(goal[:3, 3] - start[:3, 3])
    angle = np.linalg.norm(vector_of(goal[:3, :3] @ start[:3, :3].T))
    duration = max(1.0, 1.875 * size / FASTEST, 1.875 * angle / FASTEST_TURN)
    limits = [robot.limits.q_min, robot.limits.q_max, robot.limits.v_max, robot.limits.a_max]
    case = MotionCase(
        kind=kind, arm=name, urdf=robot.to_urdf(), tip=robot.tip, joints=list(robot.joints), locked=locked,
        dt=DT, q=q.tolist(), start=start.tolist(), goal=goal.tolist(), duration=float(duration),
        rest=REST if kind == "path" else max(REST, GOAL_TIME - duration),
        limits=[row.tolist() for row in limits],
    )  # fmt: skip
    return case, arm


def feasible(case, arm, restarts: int) -> str:
    """The oracle's word on a case."""
    q, goal = np.array(case.q), np.array(case.goal)
    if follows(case, arm):
        return "straight"
    found = arm.restarts(goal, q, [case.locked], count=restarts, seed=0)
    return "not known" if found is None else "other posture"


def feasible_line(case, arm, restarts: int) -> str:
    """The oracle's word on a path: also whether it can be followed from another posture of its start."""
    word = feasible(case, arm, restarts)
    if word != "other posture":
        return word
    start, seen = np.array(case.q), [np.array(case.q)]
    low, high = np.array(case.limits[0]), np.array(case.limits[1])
    generator = np.random.default_rng([SEED, 1])
    for seed in range(SEEDS):
        near = np.where(np.arange(len(start)) == case.locked, start, generator.uniform(low, high))
        q = arm.restarts(np.array(case.start), near, [case.locked], count=EACH, seed=1 + seed)
        if q is None or min(np.abs(q - one).max() for one in seen) < DISTINCT:
            continue
        seen.append(q)
        if follows(case, arm, q):
            return "from another posture"
    return "end only"


def follows(case, arm, q=None) -> bool:
    """Whether Newton steps along the line, from q or the case's, stay within limits and on it all the way."""
    poses, _ = case.targets()
    q = np.array(case.q if q is None else q)
    free = np.setdiff1d(np.arange(len(q)), [case.locked])
    low, high, v_max, _ = (np.array(row) for row in case.limits)
    stride = max(1, len(poses) // 400)
    for target in [*poses[::stride], poses[-1]]:
        before = q.copy()
        for _ in range(20):
            e, J = arm.errors(q[None], target)
            if np.abs(e).max() < 1e-8:
                break
            A = J[0][:, free]
            q[free] += A.T @ np.linalg.solve(A @ A.T + 1e-12 * np.eye(6), e[0])
        if np.abs(arm.errors(q[None], target)[0]).max() > 1e-6:
            return False
        if (q < low)[free].any() or (q > high)[free].any():
            return False
        if (np.abs(q - before) > stride * case.dt * v_max)[free].any():
            return False
    return True


def judged(case, arm, q) -> dict[str, object]:
    """What a program's joints, (K + 1, n), come to."""
    goal = np.array(case.goal)
    low, high, v_max, a_max = (np.array(row) for row in case.limits)
    v = np.diff(q, axis=0, prepend=q[:1]) / case.dt
    a = np.diff(v, axis=0) / case.dt
    end = np.abs(arm.errors(q[-1:], goal)[0][0])
    position, rotation = float(np.linalg.norm(end[:3])), float(np.linalg.norm(end[3:]))
    whole = len(q) > case.steps
    done = whole and position <= ARRIVED and rotation <= TURNED
    passed, places, left = False, False, 0.0
    if case.kind == "path":
        R, p, _ = arm.poses(q[1:])
        poses = case.targets()[0]
        left = distances(poses, R, p)
        passed = done and passes(poses, R, p, TURNED_ON_LINE)
        places = whole and position <= ARRIVED and passes(poses, R, p, np.inf)
        done = done and left <= 1.0
    free = np.arange(len(v_max)) != case.locked
    return {
        "finished": bool(done), "passed": bool(passed), "places": bool(places), "left": left,
        "error": 1e3 * position, "rotation": rotation,
        "beyond_q": bool(((q < low - 1e-6) | (q > high + 1e-6))[:, free].any()),
        "beyond_v": bool((np.abs(v) > LET_PASS * v_max).any()),
        "beyond_a": bool((np.abs(a) > LET_PASS * a_max).any()),
        "moved_locked": bool(np.abs(q[:, case.locked] - q[0, case.locked]).max() > 1e-6),
        "rests": bool(whole and (np.abs(v[-25:]) <= STILL * v_max).all()),
    }  # fmt: skip


def distances(poses, R, p) -> float:
    """The tip's largest distance from the line, by whichever time, over what is let pass."""
    worst = 0.0
    for k in range(0, len(p), 5):
        off = np.linalg.norm(poses[:, :3, 3] - p[k], axis=1)
        turned = np.arccos(np.clip(0.5 * (np.einsum("kij,ij->k", poses[:, :3, :3], R[k]) - 1.0), -1.0, 1.0))
        worst = max(worst, float(np.maximum(off / ON_LINE, turned / TURNED_ON_LINE).min()))
    return worst


def passes(poses, R, p, turned: float) -> bool:
    """Whether the tip passes places all along the line, one after the other, within 2 mm and ``turned``."""
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    ks = np.searchsorted(along, np.linspace(0.0, along[-1], PLACES))
    k = 0
    for at in ks:
        away = np.linalg.norm(p[k:] - poses[at, :3, 3], axis=1)
        cosine = 0.5 * (np.einsum("ij,kij->k", poses[at, :3, :3], R[k:]) - 1.0)
        near = np.flatnonzero((away <= ON_LINE) & (np.arccos(np.clip(cosine, -1.0, 1.0)) <= turned))
        if not near.size:
            return False
        k += int(near[0])
    return True


def main() -> int:
    """Draw, run, judge, print, write; 0 when done, 2 for bad input."""
    options = _options()
    count, restarts = (6, 500) if options.quick else (options.cases, 1000)
    drawn_cases, versions, left_out, rows, begun = {}, {}, {}, [], os.times().elapsed
    asked = options.only or tuple(PROGRAMS)
    kinds = [kind for kind in KINDS if any(kind in PROGRAMS[name][0].split() for name in asked)]
    for kind in kinds:
        pairs = [drawn(name, kind, k) for name in ARMS for k in range(count)]
        for k, (case, arm) in enumerate(pairs):
            command_line.say(f"{kind} {k + 1} of {len(pairs)}: what the oracle says")
            word = (feasible_line if kind == "path" else feasible)(case, arm, restarts)
            object.__setattr__(case, "feasible", word)
        drawn_cases[kind] = pairs
    command_line.say("")
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds:
            cases = [case for case, _ in drawn_cases[kind]]
            for name, (made_for, *_) in PROGRAMS.items():
                if kind not in made_for.split() or name not in asked:
                    continue
                command_line.say(f"{kind}s: {name}")
                try:
                    q, us, failed, found = run_script(
                        *PROGRAMS[name][1:], cases, Path(folder), options.env_dir
                    )
                except NotInstalled as error:
                    left_out[name] = str(error)
                    continue
                versions |= found
                verdicts = [
                    judged(case, arm, one) for (case, arm), one in zip(drawn_cases[kind], q, strict=True)
                ]
                rows.append(_row(kind, name, cases, verdicts, us, failed))
    command_line.say("")
    spent = os.times()
    settings = {"cases": count, "restarts": restarts, "seed": SEED, "dt": DT}
    settings |= {"processor_seconds": round(sum(spent[:4])), "seconds": round(spent.elapsed - begun)}
    result = {
        **circumstances("compare_peers", [], settings),
        "rows": rows,
        "limitations": list(LIMITATIONS),
    }
    result["versions"] |= versions
    result["left_out"] |= left_out
    tables = [_table(kind, rows) for kind in kinds if any(row["kind"] == kind for row in rows)]
    docs.publish(result, "After a lock, beside other programs", tables, options)
    return 0


def _row(kind, name, cases, verdicts, us, failed) -> dict[str, object]:
    """A program's line."""
    by_class = {
        one: [v["finished"] for case, v in zip(cases, verdicts, strict=True) if case.feasible == one]
        for one in CLASSES[kind]
    }
    count = {
        key: sum(v[key] for v in verdicts)
        for key in ("beyond_q", "beyond_v", "beyond_a", "moved_locked", "rests")
    }
    missed = [v["error"] for v in verdicts if not v["finished"]]
    passed = [v["left"] for v in verdicts if v["passed"]]
    return {
        "kind": kind, "program": name, "cases": len(cases),
        "finished": {one: [sum(done), len(done)] for one, done in by_class.items()},
        "passed": len(passed), "left": 1e3 * ON_LINE * max(passed, default=0.0),
        "places": sum(v["places"] for v in verdicts), **count, "raised": sum(map(bool, failed)),
        "why": sorted({str(why) for why in failed if why})[:3],
        "error_of_missed": float(np.median(missed)) if missed else 0.0, "us": float(np.median(us)),
    }  # fmt: skip


def _table(kind, rows) -> Table:
    """All lines of a kind."""
    counted = ("beyond_a", "beyond_v", "beyond_q", "moved_locked", "rests", "raised")
    passed = {"passed": "all places passed", "places": "all positions", "left": "left the line by [mm]"}
    passed = passed if kind == "path" else {}
    lines = [
        (r["program"], *(f"{a} of {b}" for a, b in r["finished"].values()),
         *(quantity(r[key]) if key == "left" else str(r[key]) for key in passed),
         *(str(r[key]) for key in counted),
         quantity(r["error_of_missed"]), "-" if r["raised"] else quantity(r["us"]))
        for r in rows if r["kind"] == kind
    ]  # fmt: skip
    headings = (
        f"{kind}s finished", *CLASSES[kind], *passed.values(), "beyond a_max", "beyond v_max", "beyond range",
        "moved the lock", "at rest", "raised", "off where missed [mm]", "tick [us]",
    )  # fmt: skip
    total = next(r["cases"] for r in rows if r["kind"] == kind)
    notes = (
        f"{total} {kind}s; the first columns go by what the oracle says, the others count motions, 'off' is "
        "the median at the end; what raises ends its motion there and is not timed; the tick is the median "
        "of motions, one program after another, on a machine that did other work, too.",
        *((
            "Finished is a tip that never leaves the line. 'All places passed' counts tips that pass "
            f"{PLACES} places of the line in order and end at its end, and may leave it between them, by the "
            "largest distance of the third column; 'all positions' forgets the rotation.",
            f"All are looked at {REST:g} s behind the end of the line, a PathFollower so long behind its "
            "own: it waits for the arm, and then the tip is drawn to the rotation that was given up.",
        ) if kind == "path" else ()),
    )  # fmt: skip
    return Table(
        title=f"{kind.capitalize()}s with a joint locked", headings=headings, rows=lines, notes=notes
    )


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    add = parser.add_argument
    of = "of each kind and arm (default 50)"
    add("--cases", type=command_line.at_least_one, default=50, metavar="N", help=of)
    add("--quick", action="store_true", help="6 of each kind and arm")
    add("--env-dir", type=Path, default=DEFAULT, metavar="DIR", help=f"of placo and pink (default {DEFAULT})")
    add("--only", nargs="+", choices=tuple(PROGRAMS), metavar="PROGRAM", help=f"of {', '.join(PROGRAMS)}")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
