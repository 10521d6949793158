"""ftqp beside three failure-tolerant methods of the literature, on the same motions, with paired tests.

A Panda, an iiwa14 and an xarm7 follow lines of 0.1 to 0.4 m with a turn of up to 0.6 rad; halfway, where the
tip is fastest, a joint drawn at random locks, and this is reported to all at once. Once the arms follow their
commands, once every joint drifts by a constant 0.01 rad/s that nobody knows of. The methods are a
velocity-level scheme with equality locks (Li and Zhang 2012), a noise-tolerant zeroing network (Jin, Zhang
and Li 2016) and halt optimization (Chen et al. 2020). What is compared is the distance from the line, not
from the clock, so that a method that halts loses nothing by that.

    python studies/tolerant_methods.py [--cases N] [--out DIR] [--json]

25 motions of each arm take four minutes on one core. Rows in which a method is as good or better are
published like all others.
"""

import sys
from typing import Any

import numpy as np
from bench import study
from bench.tables import Table
from papers.tolerant_methods import EqualityLocks, HaltOptimization, NoiseTolerantNetwork
from scipy.stats import binomtest, wilcoxon

import ftqp

ARMS = ("panda", "iiwa14", "xarm7")
SEED, DT, REST, DRIFT = 20261126, 4e-3, 2.0, 0.01
FASTEST, FASTEST_TURN = 0.25, 0.75
LONGEST = 3.0
"""A motion ends after so many times the line's duration, and the rest."""
OTHERS = {
    "equality locks": EqualityLocks,
    "noise-tolerant network": NoiseTolerantNetwork,
    "halt optimization": HaltOptimization,
}
METHODS = ("ftqp step", "ftqp PathFollower", *OTHERS)
ENDED, ON_LINE, LET_PASS = 2e-3, 5e-3, 1.0 + 1e-3
"""The tip has arrived within the first, and finished if it was never farther off than the second [m]."""
ROUNDED = 1e-6
"""What a joint may be beyond its range [rad]: rounding."""
LIMITATIONS = (
    "The methods are wired by us, from their published formulas (module `studies/papers/tolerant_methods.py` "
    "names them and what differs); of halt optimization, whose open article is what is known of it here, the "
    "floating base is left out.",
    "None of the three knows limits of acceleration, and an instant lock in mid-motion asks for many times "
    "what a joint has; ftqp keeps them, and pays for that with some distance at the moment of the lock.",
    "Locks are reported at once. p is two-sided, not corrected for the number of pairs.",
)


class Motion:
    """A line, and the lock halfway."""

    def __init__(self, name: str, k: int) -> None:
        self.robot = robot = ftqp.robots.load(name)
        generator = np.random.default_rng([SEED, ARMS.index(name), k])
        low, high = robot.limits.q_min, robot.limits.q_max
        while True:
            self.q = generator.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
            J = robot.jacobian(self.q) * np.array([1.0, 1.0, 1.0, *3 * [robot.length]])[:, None]
            if np.linalg.svd(J, compute_uv=False)[-1] > 0.3 * robot.length:
                break
        self.locked = int(generator.integers(robot.nv))
        way, spin = (generator.standard_normal(3) for _ in range(2))
        way *= generator.uniform(0.1, 0.4) / np.linalg.norm(way)
        spin *= generator.uniform(0.0, 0.6) / np.linalg.norm(spin)
        self.duration = max(
            1.0, 1.875 * np.linalg.norm(way) / FASTEST, 1.875 * np.linalg.norm(spin) / FASTEST_TURN
        )
        start = robot.pose(self.q)
        goal = start.copy()
        goal[:3, 3] += way
        goal[:3, :3] = _turn(spin) @ goal[:3, :3]
        self.path = ftqp.paths.PointToPoint(start, goal, duration=self.duration)
        self.line = self.path.sample(np.linspace(0.0, self.duration, 400)).pose[:, :3, 3]
        self.ticks = self.path.sample(np.arange(round(self.duration / DT) + 1) * DT)


def _turn(w):
    """exp of a rotation vector, (3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(w).as_matrix()


def ridden(motion: Motion, method: str, drift: float) -> dict[str, Any]:
    """What became of a motion under a method."""
    robot, q = motion.robot, motion.q.copy()
    at = round(0.5 * motion.duration / DT)
    last = round((motion.duration + REST) / DT)
    v, clock, kept = np.zeros(robot.nv), 0, [q.copy()]
    if method in OTHERS:
        leads = OTHERS[method](robot, DT)
    else:
        follows = method == "ftqp PathFollower"
        task = ftqp.Task(mode="scaled") if follows else None
        planner = ftqp.Planner(robot, DT, task=task, drive="velocity", emergency=None)
        planner.reset(q)
        leads = ftqp.PathFollower(planner, motion.path) if follows else planner
    locked, before = False, v
    for k in range(round((LONGEST * motion.duration + REST) / DT)):
        before = v
        if k == at:
            locked = True
            before = np.where(np.arange(robot.nv) == motion.locked, 0.0, v)
            if method in OTHERS:
                leads.lock(motion.locked, q.copy(), v.copy())
            else:
                planner.report(ftqp.Locked(motion.locked, mode="instant"))
        if method == "ftqp PathFollower":
            v = leads.step(q, None).v.copy()
            clock += int(leads.progress >= motion.duration - 1e-9 or leads.blocked is not None)
            if clock > REST / DT:
                break
        else:
            at_path = min(clock, len(motion.ticks.pose) - 1)
            pose = motion.ticks.pose[at_path]
            twist = motion.ticks.twist[at_path] if clock == at_path else np.zeros(6)
            if method in OTHERS:
                v, goes = leads.step(q, pose, twist)
                clock += int(goes)
            else:
                v, clock = leads.step(q, None, ftqp.Target(pose=pose, twist=twist)).v.copy(), clock + 1
            if clock > last:
                break
        q = q + DT * (drift + (v if method in OTHERS else 0.5 * (before + v)))
        if locked:
            q[motion.locked] = kept[-1][motion.locked]
        kept.append(q.copy())
    return _facts(motion, np.array(kept), at, drift)


def _facts(motion: Motion, q, at: int, drift: float) -> dict[str, Any]:
    """Distances from the line and its end [m], and shares of limits."""
    robot = motion.robot
    tips = np.array([robot.pose(one)[:3, 3] for one in q[at::4]])
    off = max(float(np.linalg.norm(motion.line - tip, axis=1).min()) for tip in tips)
    end = float(np.linalg.norm(robot.pose(q[-1])[:3, 3] - motion.line[-1]))
    v = np.diff(q, axis=0) / DT - drift
    a = np.diff(v, axis=0) / DT
    free = np.arange(robot.nv) != motion.locked
    speed = float((np.abs(v) / robot.limits.v_max)[:, free].max())
    sudden = float((np.abs(a) / robot.limits.a_max)[:, free].max())
    beyond = bool(((q < robot.limits.q_min - ROUNDED) | (q > robot.limits.q_max + ROUNDED))[:, free].any())
    finished = bool(end <= ENDED and off <= ON_LINE)
    return {
        "off": off, "end": end, "arrived": end <= ENDED, "finished": finished, "speed": speed,
        "acceleration": sudden, "range": beyond,
        "kept": finished and not beyond and speed <= LET_PASS and sudden <= LET_PASS,
    }  # fmt: skip


def tested(own: list[dict[str, Any]], other: list[dict[str, Any]], key: str) -> dict[str, Any]:
    """Pairs of two methods [m]: who was nearer how often by more than a tenth of a millimetre, and p."""
    a, b = (np.array([one[key] for one in rows]) for rows in (own, other))
    nearer, farther = int(np.sum(a < b - 1e-4)), int(np.sum(a > b + 1e-4))
    p = float(wilcoxon(a, b).pvalue) if np.any(a != b) else 1.0
    return {"nearer": nearer, "farther": farther, "p": p}


def signed(own: list[dict[str, Any]], other: list[dict[str, Any]], key: str) -> dict[str, Any]:
    """Pairs of which one only did it, and p of the sign test."""
    pairs = list(zip((one[key] for one in own), (one[key] for one in other), strict=True))
    nearer, farther = sum(a and not b for a, b in pairs), sum(b and not a for a, b in pairs)
    both = nearer + farther
    return {
        "nearer": nearer, "farther": farther, "p": float(binomtest(nearer, both).pvalue) if both else 1.0
    }  # fmt: skip


def every_motion(count: int) -> dict[str, Any]:
    """All motions under all methods, without and with drift."""
    motions = [Motion(name, k) for name in ARMS for k in range(count)]
    found = {}
    for drift in (0.0, DRIFT):
        rows = {}
        for method in METHODS:
            sys.stderr.write(f"{method}, drift {drift:g} rad/s\n")
            rows[method] = [ridden(motion, method, drift) for motion in motions]
        found[f"{drift:g}"] = rows
    return found


def summary(found: dict[str, Any]) -> list[dict[str, Any]]:
    """A row a method, and its pairs with ftqp's follower."""
    lines = []
    for drift, rows in found.items():
        own = rows["ftqp PathFollower"]
        for method, of in rows.items():
            lines.append({
                "drift": float(drift), "method": method, "motions": len(of),
                "finished": sum(one["finished"] for one in of), "arrived": sum(one["arrived"] for one in of),
                "kept": sum(one["kept"] for one in of), "pairs_kept": signed(own, of, "kept"),
                "off": float(np.median([one["off"] for one in of])),
                "worst": max(one["off"] for one in of),
                "end": float(np.median([one["end"] for one in of])),
                "too_fast": sum(one["speed"] > LET_PASS for one in of),
                "too_sudden": sum(one["acceleration"] > LET_PASS for one in of),
                "beyond": sum(one["range"] for one in of),
                "pairs_finished": signed(own, of, "finished"), "pairs_arrived": signed(own, of, "arrived"),
                "pairs_off": tested(own, of, "off"), "pairs_end": tested(own, of, "end"),
            })  # fmt: skip
    return lines


def tables(found: dict[str, Any]) -> list[Table]:
    """What became of the motions, and the pairs, without drift and with it."""
    shown = []
    for drift in dict.fromkeys(row["drift"] for row in found["rows"]):
        of = [row for row in found["rows"] if row["drift"] == drift]
        title = f"Every joint drifts by {drift:g} rad/s, and nobody knows" if drift else "Arms that follow"
        shown.append(Table(
            title=title,
            headings=(
                "method", "arrived", "finished", "and kept all limits",
                "off the line: median, worst [mm]", "off its end, median [mm]", "faster than v_max",
                "beyond a_max", "out of range",
            ),
            rows=[
                (row["method"], f"{row['arrived']} of {row['motions']}", f"{row['finished']}",
                 f"{row['kept']}", f"{1e3 * row['off']:.2f}, {1e3 * row['worst']:.0f}",
                 f"{1e3 * row['end']:.3f}", *(f"{row[key]}" for key in ("too_fast", "too_sudden", "beyond")))
                for row in of
            ],
            notes=(
                f"Arrived is within {1e3 * ENDED:g} mm of the end; finished is that, and never "
                f"{1e3 * ON_LINE:g} mm off the line after the lock. The last three columns count motions in "
                "which a joint that works was beyond a limit.",
            ),
        ))  # fmt: skip
        shown.append(Table(
            title="Pairs with `ftqp PathFollower`: only ftqp, only it",
            headings=(
                "beside", "arrived (sign test)", "finished (sign test)", "the same within all limits",
                "nearer the line (Wilcoxon)", "nearer the end (Wilcoxon)",
            ),
            rows=[
                (row["method"], *(_pairs(row[f"pairs_{key}"]) for key in
                 ("arrived", "finished", "kept", "off", "end")))
                for row in of if row["method"] != "ftqp PathFollower"
            ],
            notes=("Pairs count where they differ by more than 0.1 mm.",),
        ))  # fmt: skip
    return shown


def _pairs(pairs: dict[str, Any]) -> str:
    return f"{pairs['nearer']}, {pairs['farther']} (p = {pairs['p']:.2g})"


if __name__ == "__main__":
    parser = study.options(__doc__, "tolerant_methods", "two motions of each arm")
    parser.add_argument("--cases", type=int, default=25, metavar="N", help="motions of each arm (default 25)")
    study.on_record(
        parser.parse_args(), "Beside failure-tolerant methods of the literature",
        lambda given: {"rows": summary(every_motion(2 if given.quick else given.cases))}, tables, LIMITATIONS,
    )  # fmt: skip
