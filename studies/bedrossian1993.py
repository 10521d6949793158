"""Bedrossian 1993 made again: an arm of 11 joints moves its tip along lines with three joints locked.

First manoeuvre: with J1, J6, J7 locked and without, with feedback 2 1/s. Second: without locks. Third: the
second with J2, J4, J7 locked, by the pseudoinverse and with the paper's damping (eq. 16) and each other rule,
from a start that is not exactly planar (J1, J3, J9 +0.1 deg, J5 -0.1 deg), without feedback.

    python studies/bedrossian1993.py [--quick] [--out DIR] [--json]
    python studies/bedrossian1993.py --figures DIR [--only 7]

Some seconds on one core. Quick leaves all rules but the paper's out. The report and its pictures go to
studies/results. With --figures each figure of the paper is drawn by itself.
"""

import sys
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
from papers.beside import Found, Row, Sheet, draw_loop, publish
from scipy.spatial.transform import Rotation

import ftqp

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
    """Joint rates (K, 11) [deg/s], configurations (K, 11) [rad], poses of the tip (K, 4, 4), damping (K,)."""

    rates: Any
    q: Any
    tip: Any
    kappa: Any

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
    rates, motion, tips, kappa = [], [], [], []
    for k in range(round(TIME / DT)):
        target.pose[:3, 3] = start[:3, 3] + twist[:3] * (k * DT)
        step = planner.step(q, v, target)
        rates.append(step.v / DEG)
        motion.append(q)
        tips.append(robot.pose(q))
        kappa.append(step.kappa)
        q, v = step.q.copy(), step.v.copy()
    return Run(np.array(rates), np.array(motion), np.array(tips), np.array(kappa))


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


LINES = {"x": "-", "y": "--", "z": ":", "pitch": "-", "yaw": "--", "roll": ":"}
"""The lines of the paper's figures."""
RUNS = {
    "first": (ftqp.schemes.pseudoinverse(), FIRST, MOVES[0], (), 2.0),
    "first, J1, J6, J7 failed": (ftqp.schemes.pseudoinverse(), FIRST, MOVES[0], (0, 5, 6), 2.0),
    "second": (ftqp.schemes.pseudoinverse(), SECOND, MOVES[1]),
    "second, J2, J4, J7 failed": (ftqp.schemes.pseudoinverse(), SECOND + OFFSET, MOVES[1], (1, 3, 6)),
    "the same, damped": (damped("bound"), SECOND, MOVES[1], (1, 3, 6)),
}
"""What is run for the figures, by manoeuvre."""


@cache
def manoeuvre(name: str) -> tuple[Run, Any, Any, Any]:
    """A run, times (K,), where its tip is (K, 3) [in], and its turn: pitch, yaw, roll (K, 3) [deg]."""
    done = run(*RUNS[name])
    turns = Rotation.from_matrix(done.tip[:, :3, :3] @ done.tip[0, :3, :3].T)
    turned = turns.as_euler("ZYX", degrees=True)[:, [1, 0, 2]].round(6)  # without the rounding of the run
    return done, DT * np.arange(len(turned)), done.tip[:, :3, 3] / INCH, turned


def tip_sheet(name: str) -> Sheet:
    """Position and attitude of the tip."""
    done, t, place, turned = manoeuvre(name)
    share, off = done.travelled(RUNS[name][2])
    values = {"share": share, "off": off, "turned": float(np.abs(turned).max())}
    most = f"at most {off:.2g} in beside it and turned by {values['turned']:.2g} deg"
    ours = f"{100.0 * share:.1f} % of the line, {most}"
    if name == "first, J1, J6, J7 failed":
        values["apart"] = float(np.abs(place - manoeuvre("first")[2]).max())
        ours += f"; at no instant farther than {values['apart']:.2g} in from figure 2"
    parts = {"tip [in]": ("xyz", place), "turned by [deg]": (("pitch", "yaw", "roll"), turned)}
    panels = {
        label: {axis: (t, curve) for axis, curve in zip(names, curves.T, strict=True)}
        for label, (names, curves) in parts.items()
    }
    return Sheet(ours, values, partial(draw_loop, panels=panels, styles=LINES))


def joint_sheet(name: str, label: str) -> Sheet:
    """Angles or rates of the joints."""
    done, t, *_ = manoeuvre(name)
    curves = done.rates if label == RATES else done.q / DEG
    still = (np.flatnonzero(np.ptp(done.q, axis=0) == 0.0) + 1).tolist()
    most = float(np.abs(curves).max())
    ours = f"at most {most:.4g} {label.split('[')[1][:-1]}; joints that do not move at all: {still or 'none'}"
    panels = {label: {f"J{i + 1}": (t, curve) for i, curve in enumerate(curves.T)}}
    return Sheet(ours, {"most": most, "still": still}, partial(draw_loop, panels=panels))


def factor_sheet(name: str) -> Sheet:
    """The damping factor."""
    done, t, *_ = manoeuvre(name)
    first, most = DT * int(np.argmax(done.kappa > 0.0)), float(done.kappa.max())
    draw = partial(draw_loop, panels={"scale factor": {"kappa": (t, done.kappa)}})
    return Sheet(f"active from {first:.2f} s, at most {most:.3g}", {"first": first, "most": most}, draw)


ANGLES, RATES = "joint angles [deg]", "joint rates [deg/s]"
KINDS: dict[str, Any] = {
    "first": (("2", tip_sheet), ("3", joint_sheet, ANGLES)),
    "first, J1, J6, J7 failed": (("4", tip_sheet), ("5", joint_sheet, ANGLES)),
    "second": (("6", tip_sheet), ("7", joint_sheet, RATES)),
    "second, J2, J4, J7 failed": (("8", tip_sheet), ("9", joint_sheet, RATES)),
    "the same, damped": (("10", tip_sheet), ("11", joint_sheet, RATES), ("12", factor_sheet)),
}
SHEETS = {key: partial(of, name, *more) for name, sheets in KINDS.items() for key, of, *more in sheets}
"""The figures of the paper that show a result."""


if __name__ == "__main__":
    page = "bedrossian1993.md"
    sys.exit(publish("bedrossian1993", "Bedrossian 1993, made again", __doc__ or "", page, work, SHEETS))
