"""Motions that survive a failure at any instant (Zhang et al. 2016): its tables, and stronger plans, timed.

    python studies/zhang2016.py           all of it, some minutes
    python studies/zhang2016.py --quick   coarse grids, few speeds, few readings of the example
    python studies/zhang2016.py --figures DIR [--only 3]   its figures one by one, in seconds

Expected figures are those of an independent program; docs/evidence/zhang2016.md says what the paper prints
and what does not reproduce. Times are wall clock on all cores, compilation apart. Report and numbers go
to ``--out``.
"""

import sys
import time
from functools import cache, partial
from itertools import product

import numpy as np
from bench import study
from bench.tables import Table
from papers.beside import Sheet, add_figures, draw_loop, drawn_sheets
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.analysis import PlanSettings, plan
from ftqp.analysis.planning.nodes import curve_nodes
from ftqp.analysis.planning.plan_case import planning_study
from ftqp.analysis.planning.survival_labels import survivals
from ftqp.analysis.survival.continuing import tracks
from ftqp.analysis.survival.task_path import task_path
from ftqp.model.catalog.arms import published

FIGURES = published("zhang7")
Q0 = np.array(FIGURES["neutral"])
GOAL, ANGLES = (9.6, 0.0, 3.0), (-1.0, -0.5, -2.0)
SAFE = np.deg2rad([18.7, -60.7, -2.0, -77.0, 84.9, 54.7, -55.0])
USUAL = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
PLANAR = np.array([-1.524418, 1.260809, 0.741032])
SWEEP = {
    -0.18: (0.649, 1.05), -0.10: (0.689, 0.670), 0.0: (0.676, 0.496), 0.02: (0.696, 0.481),
    0.06: (0.791, 0.514), 0.10: (0.831, 0.630), 0.14: (0.811, 0.817), 0.18: (0.807, 1.07),
    0.25: (0.561, 1.64), 0.5: (0.244, 5.32), 1.0: (0.13, 20.4), -1.0: (0.11, 20.4),
}  # fmt: skip
"""Coverage and energy of the example by self-motion speed."""
METHODS = ("least motion", "constant", "gradient", "spline", "dp", "dp, free start")
EXPECTED = {
    "zhang7": (0.676, 0.831, 0.716, 0.836, 0.860, 0.860),
    "zhang7, 40 %": (0.883, 0.936, None, 0.966, 0.971, 1.000),
    "planar3": (0.7467, 0.870, None, None, 0.900, 1.000),
    "panda, y": (0.707, 0.869, 0.874, 0.893, 0.955, 0.971),
    "panda, x": (0.729, 0.898, 0.888, 0.926, 0.942, 0.952),
    "iiwa14, x": (None, None, None, None, None, 0.857),
}
CONVENTIONS = ("xyz", "XYZ", "zyx", "ZYX", "ZYZ", "ZXZ", "rotation vector")
"""Readings of three angles; small letters turn about fixed axes."""
LIMITATIONS = (
    "The start of a Panda line is the node of its first self-motions next to the usual posture.",
    "A plan by dp is the best one on its grid; half the step and half the spacing are given beside it.",
    "Readings of the example are bounded on coarse grids with joint speeds up to 2 rad/s and a free start.",
    "Times are of a machine that others use.",
)


def example_arm(offset=True):
    """The arm of the example without speed limits, its table with or without the offsets of the angles."""
    if offset:
        return ftqp.robots.load("zhang7").with_limits(v_max=np.inf)
    table = [(0.0, d, a, alpha) for _, d, a, alpha in FIGURES["dh"]]
    bend = np.deg2rad(150.0)
    limits = {"q_min": -bend, "q_max": bend, "v_max": 2.0}
    return ftqp.Robot.from_dh(table, name="zhang7", limits=limits, neutral=Q0, gravity=(0.0, 0.0, 0.0))


def example(share=1.0, dt=0.05):
    """The path of the example, or a share of its way."""
    arm = example_arm()
    start = arm.pose(Q0)
    end = np.eye(4)
    turn = Rotation.from_matrix(start[:3, :3]).inv() * Rotation.from_euler("xyz", ANGLES)
    end[:3, :3] = start[:3, :3] @ Rotation.from_rotvec(share * turn.as_rotvec()).as_matrix()
    end[:3, 3] = start[:3, 3] + share * (np.array(GOAL) - start[:3, 3])
    return task_path(arm, ftqp.paths.PointToPoint(start, end, duration=20.0), dt=dt)


def line(arm, start, way, duration, dt, rows="pose"):
    """A straight line."""
    return task_path(arm, ftqp.paths.Line(start, way, duration=duration), dt=dt, rows=rows)


def panda_line(position, way):
    """A line of the Panda, tool down, and the node of its start next to the usual posture."""
    start = np.diag([1.0, -1.0, -1.0, 1.0])
    start[:3, 3] = position
    task = line(ftqp.robots.load("panda"), start, way, 6.0, 0.025)
    nodes = curve_nodes(planning_study(task, 0.06), task.goals[:1], spacing=0.06, seed=0)[0]
    return task, nodes[np.argmin(np.linalg.norm(nodes - USUAL, axis=1))]


def paths(quick):
    """Name, task, start and waypoints of each path."""
    if not quick:
        yield "zhang7", example(), Q0, 80
        yield "zhang7, 40 %", example(0.4), Q0, 80
    three = ftqp.robots.load("planar", lengths=(1.0, 1.0, 1.0), continuous=True)
    start = three.pose(PLANAR)
    way = np.array([0.5, 1.2, 0.0]) - start[:3, 3]
    yield "planar3", line(three, start, way, 10.0, 0.1, "position"), PLANAR, 100
    yield "panda, y", *panda_line((0.45, -0.2, 0.35), (0.0, 0.4, 0.0)), 60
    if quick:
        return
    yield "panda, x", *panda_line((0.45, 0.1, 0.35), (0.05, 0.0, 0.0)), 60
    iiwa = ftqp.robots.load("iiwa14")
    bent = np.deg2rad([30.0, 30.0, 30.0, -80.0, 20.0, 60.0, 0.0])
    yield "iiwa14, x", line(iiwa, iiwa.pose(bent), (0.05, 0.0, 0.0), 4.0, 0.05), bent, 40


def timed(work):
    """What it gives, and how long it took [s]."""
    began = time.perf_counter()
    found = work()
    return found, time.perf_counter() - began


def sweep():
    """Coverage and energy of the example at constant self-motion speeds."""
    task = example()
    thetas = np.array(list(SWEEP))
    q, _ = tracks(task, np.tile(Q0, (len(thetas), 1)), thetas[:, None])
    found = survivals(task, q, 4)
    energy = (np.diff(q, axis=1) ** 2).sum(axis=(1, 2)) / task.dt
    return [
        {"theta": theta, "coverage": float(c), "energy": float(e), "within": bool(inside)}
        for theta, c, e, inside in zip(SWEEP, found.coverage, energy, found.excess <= 1e-9, strict=True)
    ]


def compared(quick):
    """Every method on every path: coverage, energy, time."""
    rows = []
    for name, task, q0, waypoints in paths(quick):
        knobs = PlanSettings(waypoints=waypoints)
        if quick:
            knobs = PlanSettings(
                waypoints=20, spacing=0.2, thetas=tuple(np.arange(-4, 5) / 10), evaluations=10
            )
        plan(task.robot, task, q0, settings=PlanSettings(waypoints=4, spacing=0.5, share=1.0, stride=40))
        still = PlanSettings(thetas=(0.0,))
        for method in METHODS:
            way = {"least motion": "constant", "dp, free start": "dp"}.get(method, method)
            start = None if method.endswith("start") else q0
            settings = still if method == "least motion" else knobs
            made, seconds = timed(
                lambda t=task, s=start, w=way, k=settings: plan(t.robot, t, s, w, settings=k)
            )
            row = {"path": name, "method": method, "coverage": made.coverage, "energy": made.energy}
            row |= {"seconds": seconds, "speed": float(np.abs(made.v).max())}
            found = made.settings
            if way == "dp":
                row |= {
                    "bound": found["bound"],
                    "nodes": found["nodes_in_all"],
                    "grid": found["coverage_on_grid"],
                }
            if way == "constant":
                row |= {"theta": found["theta"]}
            rows.append(row)
    return rows


def finer(quick):
    """What half the step and half the spacing change."""
    rows = []
    cases = [
        (name, task, waypoints)
        for name, task, _, waypoints in paths(quick)
        if name in ("planar3", "panda, y")
    ]
    for name, task, waypoints in cases:
        grids = [(waypoints, 0.06)] + ([] if quick else [(2 * waypoints, 0.03)])
        made = [plan(task.robot, task, settings=PlanSettings(waypoints=K, spacing=ds)) for K, ds in grids]
        rows.append({"path": name, "coverage": [one.coverage for one in made]})
    return rows


def safe_start():
    """The example's first 40 % from a start on its first self-motion, with no self-motion at all."""
    task = example(0.4)
    q, _ = tracks(task, SAFE[None])
    found = survivals(task, q, 1)
    return {"pairs": 7 * task.N, "coverage": float(found.coverage[0])}


def readings(quick):
    """The most that any self-motion survives of each reading of the example, on a coarse grid."""
    rows = []
    for offset, convention, geodesic in product((True, False), CONVENTIONS, (True, False)):
        if quick and (not offset or convention not in CONVENTIONS[:1]):
            continue
        arm = example_arm(offset).with_limits(v_max=2.0)
        start, s = arm.pose(Q0), np.linspace(0.0, 1.0, 51)
        first, last = Rotation.from_matrix(start[:3, :3]), _turned(convention, ANGLES)
        turn = (first.inv() * last).as_rotvec()
        turns = first * Rotation.from_rotvec(s[:, None] * turn)
        if not geodesic:
            angles = _angles(convention, first)
            turns = _turned(convention, angles + s[:, None] * (np.array(ANGLES) - angles))
        goals = np.tile(np.eye(4), (len(s), 1, 1))
        goals[:, :3, :3] = turns.as_matrix()
        goals[:, :3, 3] = start[:3, 3] + s[:, None] * (np.array(GOAL) - start[:3, 3])
        row = {"offset": offset, "convention": convention, "geodesic": geodesic}
        try:
            knobs = PlanSettings(waypoints=50, spacing=0.12, share=1.0, stride=1)
            made = plan(arm, goals, dt=0.4, settings=knobs)
            row |= {"grid": made.settings["coverage_on_grid"], "first": made.settings["bound"][0]}
        except ftqp.InputError as error:
            row |= {"refused": str(error)}
        rows.append(row)
    return rows


def _turned(convention, angles):
    """Rotations of angles as one reads them."""
    if convention == "rotation vector":
        return Rotation.from_rotvec(angles)
    return Rotation.from_euler(convention, angles)


def _angles(convention, rotation):
    """The angles of a rotation."""
    return rotation.as_rotvec() if convention == "rotation vector" else rotation.as_euler(convention)


def tables(found):
    """Its tables, stronger plans, finer grids and readings."""
    sweep = [
        (f"{row['theta']:g}", f"{row['coverage']:.3f}", f"{SWEEP[row['theta']][0]:g}",
         f"{row['energy']:.3f}", f"{SWEEP[row['theta']][1]:g}", "yes" if row["within"] else "no")
        for row in found["sweep"]
    ]  # fmt: skip
    compared = []
    for name in dict.fromkeys(row["path"] for row in found["compared"]):
        rows, cells = [row for row in found["compared"] if row["path"] == name], []
        for row, expected in zip(rows, EXPECTED[name], strict=True):
            told = "" if expected is None else f" ({expected:g})"
            cells.append(f"{row['coverage']:.3f}{told}, {row['seconds']:.1f} s")
        compared.append((name, *cells))
    free = [
        (row["path"], f"{row['nodes']}", f"{row['grid']:.3f}",
         f"{min(row['bound'])} to {max(row['bound'])}", f"{row['speed']:.2f}", f"{row['energy']:.3f}")
        for row in found["compared"] if row["method"] == METHODS[-1]
    ]  # fmt: skip
    finer = [(row["path"], ", then ".join(f"{one:.4f}" for one in row["coverage"])) for row in found["finer"]]
    readings = [
        ("used" if row["offset"] else "not used", row["convention"],
         "shortest turn" if row["geodesic"] else "angles linear",
         *((f"{row['grid']:.3f}", f"{row['first']}") if "grid" in row else (row["refused"], "")))
        for row in found["readings"]
    ]  # fmt: skip
    safe = found["safe_start"]
    return [
        Table(
            title="One self-motion speed for all of the path",
            headings=(
                "theta [rad/s]", "coverage", "expected", "energy [rad^2/s]", "expected", "within limits"
            ),
            rows=sweep,
            notes=("The example, 400 samples, failures at every fourth, +-150 degrees, no speed limits.",),
        ),
        Table(
            title="Methods: coverage (expected) and seconds; failures at every fourth sample",
            headings=("path", *METHODS), rows=compared,
        ),
        Table(
            title="With a free start",
            headings=(
                "path", "nodes", "on the grid", "bound", "largest speed [rad/s]", "energy [rad^2/s]"
            ),
            rows=free,
            notes=(
                "Bound is how many joints the best node of a waypoint can miss, least to most.",
                "The first 40 % of the example from the start on its self-motion, theta = 0: "
                f"{safe['coverage']:.4f} of {safe['pairs']} pairs.",
            ),
        ),
        Table(title="Half the step, half the spacing", headings=("path", "coverage"), rows=finer),
        Table(
            title="Every reading of the example",
            headings=("offsets", "angles", "orientation", "coverage at most", "joints at the start"),
            rows=readings,
            notes=(
                "The paper does not say how its three angles are read, or how the orientation goes from "
                "start to end. The most that a trajectory survives of each reading, and how many joints the "
                "best start can miss, on a coarse grid.",
            ),
        ),
    ]  # fmt: skip


def pictures(result, folder, stem):
    """Draws the sweep, and which failures the example survives without self-motion and with the best one."""
    rows = sorted(result["sweep"], key=lambda row: row["theta"])
    theta = [row["theta"] for row in rows]
    curves = {
        label: {
            "expected": (theta, [SWEEP[one][at] for one in theta]),
            "ftqp": (theta, [row[key] for row in rows]),
        }
        for at, (label, key) in enumerate((("coverage", "coverage"), ("energy [rad^2/s]", "energy")))
    }
    files = [folder / f"{stem}-{word}.png" for word in ("sweep", "none", "best")]
    draw_loop(
        files[0], "One self-motion speed for all of the path", curves, x_label="self-motion speed [rad/s]",
        logarithmic=["energy [rad^2/s]"],
    )  # fmt: skip
    task = example()
    for file, speed in zip(
        files[1:], (0.0, max(rows, key=lambda row: row["coverage"])["theta"]), strict=True
    ):
        q, _ = tracks(task, Q0[None], np.array([[speed]]))
        ftqp.analysis.coverage(task.robot, task, q[0], stride=4).figure(file)
    return files


@cache
def planned():
    """The example's plan with the one speed of self-motion that survives most, see SWEEP."""
    return plan(example_arm(), example(), Q0, "constant", settings=PlanSettings(thetas=(0.10,)))


def lock_sheet(joint, at):
    """Joints of the plan, and of what follows a lock, with the errors of the tip."""
    made, task = planned(), example()
    after = made.continue_after(joint - 1, at)
    late, goals = task.t[-len(after) :], task.goals[-len(after) :]
    tips = np.array([task.robot.pose(q) for q in after])
    off = float(np.linalg.norm(tips[:, :3, 3] - goals[:, :3, 3], axis=1).max())
    turns = Rotation.from_matrix(goals[:, :3, :3]) * Rotation.from_matrix(tips[:, :3, :3]).inv()
    most = float(np.rad2deg(np.abs(after)).max())
    values = {"off": off, "turned": float(turns.magnitude().max()), "most": most}
    curves = {}
    for i in range(7):
        curves[f"joint {i + 1}"] = (task.t, np.rad2deg(made.q[:, i]))
        curves[f"joint {i + 1}, after"] = (late, np.rad2deg(after[:, i]))
    styles = {name: ":" for name in curves if "after" in name}
    fault = (at, f"joint {joint} locks")
    draw = partial(draw_loop, panels={"joint angles [deg]": curves}, styles=styles, fault=fault)
    ours = "finished, at most {off:.2g} m and {turned:.2g} rad off, joints within {most:.0f} of 150 deg"
    return Sheet(ours.format(**values), values, draw)


def path_sheet():
    """The path of the tip."""
    t, place = example().t, example().goals[:, :3, 3]
    curves = {axis: (t, values) for axis, values in zip("xyz", place.T, strict=True)}
    ends = {"start": place[0].tolist(), "end": place[-1].tolist()}
    ours = " to ".join("({:.3f}, {:.3f}, {:.3f})".format(*end) for end in ends.values())
    draw = partial(draw_loop, panels={"tip [m]": curves}, styles={"y": "--", "z": ":"})
    return Sheet(f"from {ours} m", ends, draw)


SHEETS = {"2": path_sheet, "3": partial(lock_sheet, 4, 5.0), "4": partial(lock_sheet, 2, 10.0)}
"""The figures of the paper that show a result."""


def measured(given):
    """All that the tables show."""
    quick = given.quick
    return {
        "sweep": sweep(), "compared": compared(quick), "safe_start": safe_start(), "finer": finer(quick),
        "readings": readings(quick),
    }  # fmt: skip


if __name__ == "__main__":
    parser = study.options(__doc__, "zhang2016", "coarse grids, few speeds, few readings")
    add_figures(parser)
    given = parser.parse_args()
    if given.figures is not None:
        sys.exit(drawn_sheets("zhang2016", SHEETS, given.figures, given.only))
    title = "Motions that survive a failure at any instant (Zhang et al. 2016)"
    study.on_record(given, title, measured, tables, LIMITATIONS, figures=pictures)
