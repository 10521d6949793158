"""Bedrossian 1993 made again: an arm of 11 joints moves its tip along lines with three joints locked.

First manoeuvre: with J1, J6, J7 locked and without, with feedback 2 1/s. Second: without locks. Third: the
second with J2, J4, J7 locked, by the pseudoinverse and with the paper's damping (eq. 16) and each other rule,
from a start that is not exactly planar (J1, J3, J9 +0.1 deg, J5 -0.1 deg), without feedback.

    python studies/bedrossian1993.py [--quick] [--out DIR] [--json]

Some seconds on one core. Quick leaves all rules but the paper's out. The report and its pictures go to
studies/results.
"""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from papers.beside import Found, Row, told

import ftqp
from ftqp.viz.figures.loop_picture import draw_loop

INCH, DEG = 0.0254, np.pi / 180.0
FIRST = np.array([45, -60, 0, -45, 0, 45, 90, 45, 0, 0, 0]) * DEG
SECOND = np.array([0, -50, 0, -30, 0, 70, 0, 30, 0, 0, 0]) * DEG
OFFSET = np.array([0.1, 0, 0.1, 0, -0.1, 0, 0, 0, 0.1, 0, 0]) * DEG
MOVES = (np.array([-5.5, -2.5, 1.5, 0, 0, 0]) * INCH, np.array([-5.0, 0, 0, 0, 0, 0]) * INCH)
"""Twists of the first and of the later manoeuvres [m/s, rad/s]."""
DT, TIME = 0.01, 20.0
RULES = ("bound", "bound_2", "tight", "row", "exact_inf", "exact_2")
"""The paper's, and the others of ``ftqp.Damping``."""


class Run(NamedTuple):
    """Joint rates, (K, 11) [deg/s], configurations, (K, 11) [rad], and poses of the tip, (K, 4, 4)."""

    rates: Any
    q: Any
    tip: Any

    def travelled(self, twist: Any) -> tuple[float, float]:
        """Share of the line, and the largest distance from it [in]."""
        along = twist[:3] / np.linalg.norm(twist[:3])
        moved = self.tip[:, :3, 3] - self.tip[0, :3, 3]
        way = moved @ along
        off = np.linalg.norm(moved - way[:, None] * along, axis=1)
        return float(way[-1] / (np.linalg.norm(twist[:3]) * TIME)), float(off.max()) / INCH


def run(scheme: Any, q: Any, twist: Any, locks: tuple[int, ...] = (), gain: float = 0.0) -> Run:
    """Follow a constant twist; a gain of 0 is without feedback."""
    robot = ftqp.robots.load("modular11").with_limits(v_max=1e6, a_max=1e9)  # no bound shapes the motion
    task = ftqp.Task(kp=gain, rows="pose", calm=False)
    planner = ftqp.Planner(robot, DT, level="velocity", scheme=scheme, task=task, emergency=None)
    for joint in locks:
        planner.report(ftqp.Locked(joint))
    planner.reset(q)
    start = robot.pose(q)
    target, v = ftqp.Target(pose=start, twist=twist), np.zeros(robot.nv)
    rates, motion, tips = [], [], []
    for k in range(round(TIME / DT)):
        target.pose[:3, 3] = start[:3, 3] + twist[:3] * (k * DT)
        step = planner.step(q, v, target)
        rates.append(step.v / DEG)
        motion.append(q)
        tips.append(robot.pose(q))
        q, v = step.q.copy(), step.v.copy()
    return Run(np.array(rates), np.array(motion), np.array(tips))


def damped(rule: str) -> Any:
    """The damped inverse by a rule, at the paper's limit of 50 deg/s."""
    return ftqp.schemes.singularity_robust(rule=rule, limit=50.0 * DEG)


def work(quick: bool) -> Found:
    """The three manoeuvres."""
    plain = ftqp.schemes.pseudoinverse()
    free, locked = (run(plain, FIRST, MOVES[0], locks, gain=2.0) for locks in ((), (0, 5, 6)))
    apart = float(np.abs(free.tip[-1, :3, 3] - locked.tip[-1, :3, 3]).max()) / INCH
    still = float(np.ptp(locked.q[:, [0, 5, 6]], axis=0).max())
    second = run(plain, SECOND, MOVES[1])
    third = run(plain, SECOND + OFFSET, MOVES[1], (1, 3, 6))
    crossed = DT * int(np.argmax(np.abs(third.rates).max(axis=1) > 50.0))
    rows = [
        Row(
            "first manoeuvre, J1, J6, J7 locked", "same motion of the tip, locked joints still",
            f"tips end within {apart:.3f} in along each axis, locked joints move by {still:g} rad",
        ),
        Row("second manoeuvre, no lock: joint rates", "< 6 deg/s", f"{np.abs(second.rates).max():.2f} deg/s"),
        Row("third, J2, J4, J7 locked: rates grow", "after about 2 s", f"50 deg/s at {crossed:.2f} s"),
    ]  # fmt: skip
    runs = {"pseudoinverse": third}
    for rule in RULES[:1] if quick else RULES:
        runs[rule] = run(damped(rule), SECOND + OFFSET, MOVES[1], (1, 3, 6))
        share, off = runs[rule].travelled(MOVES[1])
        published = "about halfway from the planar start" if rule == "bound" else ""
        found = f"{100.0 * share:.1f} % of the way, at most {off:.2g} in off the line"
        rows.append(Row(f"third, damped by `{rule}`, from start R", published, found))
    pictures = {
        "first": partial(draw, "First manoeuvre, J1, J6, J7 locked", locked),
        "second": partial(draw, "Second manoeuvre, no lock", second),
        "third": partial(draw, "Third manoeuvre, J2, J4, J7 locked, damped by eq. 16", runs["bound"]),
    }
    return Found(rows, pictures)


def draw(title: str, done: Run, file: Any) -> None:
    """The joint rates, as the paper draws them, and the arm."""
    t = DT * np.arange(len(done.rates))
    curves = {f"J{i + 1}": (t, rate) for i, rate in enumerate(done.rates.T)}
    robot = ftqp.robots.load("modular11")
    draw_loop(file, title, {"joint rates [deg/s]": curves}, arm=(robot, done.q))


if __name__ == "__main__":
    told("bedrossian1993", "Bedrossian 1993, made again", __doc__ or "", "bedrossian1993.md", work)
