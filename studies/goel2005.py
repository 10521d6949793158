"""Failures that nobody reports (Goel, Maciejewski and Balakrishnan 2005): every figure, recomputed, timed.

    python studies/goel2005.py           all of it, about a minute; pictures beside the report
    python studies/goel2005.py --quick   a quarter of the configurations and a hundredth of the brute force
    python studies/goel2005.py --figures DIR [--only 7]   its figures one by one

Expected figures are those of an independent program; docs/evidence/goel2005.md says what the paper prints and
what does not reproduce. CPU times are those of one thread, compilation apart. Report and numbers go
to ``--out``.
"""

import sys
import time
from functools import cache, partial

import numpy as np
from bench import study
from bench.tables import Table
from papers.beside import Sheet, add_figures, drawn_sheets

import ftqp
from ftqp.analysis import (
    basins,
    joint_ranges,
    map_chunk,
    outcome,
    point_to_point,
    points,
    rest_curves,
    workspace_task,
)

DEG = np.pi / 180.0
GOAL, SLOW_GOAL = (1.5, 1.5), (-0.8, 0.0)
SPECIAL = 45.0 + np.degrees(np.arccos(1.0 / np.hypot(*GOAL)))
LIMITATIONS = (
    "Start configurations of figures 5 to 7 are recovered from tip positions in print; failures are at once.",
    "The brute force takes every fortieth point, with as many configurations as the independent program.",
    "CPU times vary by a tenth from run to run on a machine that others use.",
)
EXPECTED_MEANS = {
    "R100": (35.87, 54.46, 51.85, 17.95),
    "Ravg": (56.35, 68.98, 69.66, 28.01),
    "Rsens": (92.2, 78.2, 77.5, 82.1),
}
EXPECTED_POINTS = {
    (2.0, -1.4): ((40.8, 70.8, 64.2, 16.9), (59.4, 80.6, 76.8, 30.4)),
    (-0.9, 1.8): ((45.3, 63.6, 60.6, 14.2), (63.3, 69.8, 67.9, 22.7)),
}
HORIZONS = {10.0: 0.6, 20.0: 10.0, 50.0: 89.0, 100.0: 97.0}


def arm(count):
    """A planar arm of unit links."""
    return ftqp.robots.load("planar", lengths=(1.0,) * count, continuous=True)


def polar(rho, phi):
    """A goal about joint 2 of the 2R arm, joint 1 locked at 0."""
    return 1.0 + rho * np.cos(phi * DEG), rho * np.sin(phi * DEG)


def figure_6_start():
    """The configuration at (-0.9, 1.8) with joint 1 where a whole circle is at rest."""
    wrist = complex(-0.9, 1.8) - np.exp(1j * SPECIAL * DEG)
    elbow = np.degrees(np.arccos(0.5 * abs(wrist) ** 2 - 1.0))
    first = np.degrees(np.angle(wrist) - np.angle(1.0 + np.exp(1j * elbow * DEG)))
    return SPECIAL, first - SPECIAL, elbow


def cases():
    """Name, links, goal, start [degrees], locked joint, and what is expected."""
    two = (0.0, -30.0)
    yield "2R, goal A (1, 45)", 2, polar(1, 45), two, "j1", "correct, -315"
    yield "2R, goal B (1, 0)", 2, polar(1, 0), two, "j1", "erroneous, no motion, 0.517638"
    yield "2R, goal C (2, 120)", 2, polar(2, 120), two, "j1", "erroneous, -261.787, 1.133893"
    yield "2R, goal D (2, 60)", 2, polar(2, 60), two, "j1", "none, 3.62760 s, 1 to 3"
    for phi, error in ((61, 1.71477), (75, 1.50668), (90, 1.34164), (180, 1.0)):
        yield f"2R, (2, {phi})", 2, polar(2, phi), two, "j1", f"erroneous, {error}"
    yield "2R, (2, 30)", 2, polar(2, 30), two, "j1", "singular, 1.23931"
    yield "Fig. 5", 3, GOAL, (-79.3348, 45.0, 42.7735), "j2", "correct, (-5.6173, 45, 66.1698)"
    yield "Fig. 5, other", 3, GOAL, (-35.6493, 45.0, -87.7735), "j2", "correct, (50.6173, 45, -111.1698)"
    yield "Fig. 6", 3, GOAL, figure_6_start(), "j1", "erroneous, (106.8745, -65.6468, 180), 1.870829"
    yield (
        "Fig. 6, 150",
        3,
        GOAL,
        (150.0, -107.9446, 98.8833),
        "j1",
        "erroneous, (150, -109.2385, 0), 0.904434",
    )
    for value, period in ((30, 7.74332), (10, 1.897359), (20, 4.172185), (40, 22.23123)):
        told = ", 0.227119 to 1.776600" if value == 30 else ""
        yield f"Fig. 7, {value}", 3, SLOW_GOAL, (10.8852, 72.5087, value), "j3", f"none, {period} s{told}"
    yield "Fig. 7, 45", 3, SLOW_GOAL, (10.8852, 72.5087, 45.0), "j3", "erroneous, 0.161"


def ends():
    """The cases, (rows), each with its expectation."""
    rows = []
    for name, count, goal, start, joint, expected in cases():
        found = outcome(arm(count), goal, np.array(start) * DEG, joint)
        rows.append(
            {
                "case": name, "expected": expected, "kind": found.kind, "q": np.degrees(found.q).tolist(),
                "error": found.error, "rate": found.rate, "period": found.period,
                "error_range": found.error_range, "reason": found.reason,
            }
        )  # fmt: skip
    return rows


def timed(work):
    """What it gives, and its CPU time [s]."""
    began = time.process_time()
    found = work()
    return found, time.process_time() - began


def maps(quick):
    """The map, its points in print, and its CPU time."""
    task = workspace_task(arm(3), GOAL, configurations=22 if quick else 90, instants=0)
    every = points(task)
    map_chunk(task, every[:1])
    found, seconds = timed(lambda: map_chunk(task, every))
    printed = map_chunk(task, np.array([(*point, 0.0) for point in EXPECTED_POINTS]))
    return {
        "points": len(every),
        "configurations": int(found["configurations"].sum()),
        "failed": int(found["failed"].sum()),
        "seconds": seconds,
        "means": {k: found[k].mean(axis=0).tolist() for k in ("R100", "Ravg", "Rsens")},
        "whole": (found["R100"] > 100.0 - 1e-9).sum(axis=0).tolist(),
        "some": (found["R100"] > 0.0).sum(axis=0).tolist(),
        "printed": {name: printed[name].tolist() for name in ("R100", "Ravg")},
    }, {"places": every, **{k: found[k] for k in ("R100", "Ravg", "Rsens")}}


def brute_force(quick):
    """All failures in range simulated, every fortieth point; what became of them."""
    task = workspace_task(arm(3), GOAL, configurations=60, instants=100)
    some = points(task)[:: 400 if quick else 40]
    map_chunk(task, some[:1])
    found, seconds = timed(lambda: map_chunk(task, some))
    return {
        "points": len(some),
        "runs": int(found["runs"].sum()),
        "unresolved": int(found["unresolved"].sum()),
        "Favg": np.nanmean(found["Favg"], axis=0).tolist(),
        "F100": np.nanmean(found["F100"], axis=0).tolist(),
        "seconds": seconds,
    }


def horizons():
    """Shares of failures of joint 1, at once and in range, from (-0.9, 1.8) that have succeeded by a time."""
    task = workspace_task(arm(3), GOAL, configurations=2000)
    (q,) = task.starts(np.array([-0.9, 1.8, 0.0]))
    ((low, high),) = task.ranges[0].intervals
    q = q[np.mod(q[:, 0] - low, 2.0 * np.pi) <= high - low]
    _, _, facts = task.study().runs(q, np.full(len(q), 1), horizon=max(HORIZONS), success=1e-2)
    return {f"{T:g}": 100.0 * float(np.mean(facts[:, 1] <= T)) for T in HORIZONS}


def figure_8():
    """The basins of figure 8."""
    found = basins(arm(3), GOAL, "j2", 45.0 * DEG)
    return {
        "share": found.share.tolist(),
        "ends": np.degrees(found.ends).tolist(),
        "saddles": np.degrees(found.saddles).tolist(),
        "eigenvalues": found.eigenvalues.tolist(),
    }, found


def pictures(found_map, found_basins):
    """A function that draws all pictures into a folder."""
    from papers import goel_pictures

    from ftqp.viz.figures import study_pictures
    from ftqp.viz.figures.loop_picture import draw_loop

    def motion(file, title, goal, start, joint, duration):
        robot = arm(3)
        way = point_to_point(robot, goal, np.array(start) * DEG, duration=duration, locked=joint)
        cross = np.append(goal, 0.0) + 0.1 * np.stack([-np.eye(3), np.eye(3)], axis=1)
        panels = {"distance from the goal [m]": {joint: (way.t, way.errors)}}
        return draw_loop(file, title, panels, arm=(robot, way.q), edges=cross)

    def draw(result, out, name):
        parts = ("figure-5", "basins", "two-links", "figure-6", "cycle")
        files = [out / f"{name}-{part}.png" for part in parts]
        starts = (-79.3348, 45.0, 42.7735), (150.0, -107.9446, 98.8833)
        motion(files[0], "Fig. 5: joint 2 locks at 45°, unreported", GOAL, starts[0], "j2", 12.0)
        motion(files[3], "Fig. 6: joint 1 locks at 150°, unreported", GOAL, starts[1], "j1", 30.0)
        motion(files[4], "No rest, Fig. 7: joint 3 at 30°", SLOW_GOAL, (10.8852, 72.5087, 30.0), "j3", 30.0)
        a, b = found_basins.moving
        goel_pictures.draw_basins(
            files[1], "Figure 8: joint 2 locked at 45°", (f"joint {a + 1}", f"joint {b + 1}"),
            found_basins.angles, found_basins.label, found_basins.ends[:, [a, b]], found_basins.kinds,
            found_basins.saddles[:, [a, b]], [way[:, [a, b]] for way in found_basins.separatrices],
        )  # fmt: skip
        within = joint_ranges(arm(3), GOAL, rows="position")
        rests = [
            goel_pictures.draw_rests(
                out / f"{name}-rests-{joint}.png", f"Figure 9: joint {joint[1]} locked",
                rest_curves(arm(3), GOAL, joint), within[joint],
            )
            for joint in within
        ]  # fmt: skip
        goel_pictures.draw_error_signs(files[2], "Joint 1 locked at 0: figures 3 and 4", two_links())
        q = np.array([-5.6173, 45.0, 66.1698]) * DEG
        posture = np.concatenate([[0.0], np.cumsum(np.exp(1j * np.cumsum(q)))])
        maps = study_pictures.save_maps(
            out, "Three unit links", ("joint 1", "joint 2", "joint 3"), np.array((*GOAL, 0.0)),
            np.column_stack([posture.real, posture.imag, 0.0 * posture.real]), {**found_map},
        )  # fmt: skip
        kept = [file.rename(out / f"{name}-map-{file.name}") for file in maps]
        return [*files, *rests, *kept]

    return draw


@cache
def measured():
    """Map and basins, made once: what is told of them, and what draws all pictures."""
    found, arrays = maps(quick=False)
    told, fields = figure_8()
    return found, told, cache(partial(pictures(arrays, fields), None))


def sheet(part, ours):
    """A figure, which is drawn with all others; ``ours`` says what is found, of the map and the basins."""
    found, told, draw = measured()
    said, file = ours(found, told), f"goel2005-{part}.png"
    return Sheet(said, {"said": said}, lambda path, _: draw(path.parent, "goel2005"), file=file)


def case_ends(*names):
    """What is found of some cases."""
    rows = [row for row in ends() if row["case"].startswith(names)]
    found = [
        f"every {row['period']:.6g} s" if row["period"] else f"error {row['error']:.6f} m" for row in rows
    ]
    return "; ".join(f"{row['case']}: {row['kind']}, {end}" for row, end in zip(rows, found, strict=True))


def basin_shares(_, told):
    """Areas of the basins, and how many saddles part them."""
    shares = " and ".join(f"{100.0 * share:.2f}" for share in told["share"])
    return f"{shares} % of the area, {len(told['saddles'])} saddles"


def rest_changes(*_):
    """Where the goal is within reach with joint 1 locked, and where the arm rests off it [degrees]."""
    within = np.degrees(joint_ranges(arm(3), GOAL, rows="position")["j1"].intervals)
    off = np.degrees(rest_curves(arm(3), GOAL, "j1").sink_intervals().intervals)
    return f"within reach at {within.round(4).tolist()}, it rests off it at {off.round(4).tolist()}"


def map_means(found, _):
    """The two points in print, and the means of the map."""
    two, one = found["printed"]["R100"][0][1], found["printed"]["R100"][1][0]
    means = ", ".join(f"{value:.2f}" for value in found["means"]["R100"])
    return f"{two:.0f} and {one:.0f} % at the two points; means of R100 {means} % (joints 1, 2, 3, any)"


SHEETS = {
    "3 and 4": partial(sheet, "two-links", lambda *_: case_ends("2R, goal")),
    "5": partial(sheet, "figure-5", lambda *_: case_ends("Fig. 5")),
    "6": partial(sheet, "figure-6", lambda *_: case_ends("Fig. 6, 150")),
    "7": partial(sheet, "cycle", lambda *_: case_ends("Fig. 7, 30")),
    "8": partial(sheet, "basins", basin_shares),
    "9": partial(sheet, "rests-j1", rest_changes),
    "10": partial(sheet, "map-R", map_means),
}
"""The figures of the paper that show a result."""


def two_links():
    """Where the error falls and which way joint 2 turns, for goals at two distances from joint 2."""
    from papers.goel_pictures import SignPanel

    phi, theta = np.linspace(-np.pi, np.pi, 241), np.linspace(-np.pi, np.pi, 241)
    panels = {}
    for rho in (1.0, 2.0):
        x, y = 1.0 + rho * np.cos(phi)[:, None], rho * np.sin(phi)[:, None]
        half = np.where(np.abs(theta) < 1e-9, 1e-9, theta)[None, :] / 2.0
        rate = (2.0 - x) / np.tan(half) - y
        ex, ey = x - 1.0 - np.cos(theta)[None, :], y - np.sin(theta)[None, :]
        falls = rate * (-ex * np.sin(theta)[None, :] + ey * np.cos(theta)[None, :]) > 0.0
        panels[f"goal {rho:g} m from joint 2"] = SignPanel(
            phi=phi, theta=theta, falls=falls, rate=rate,
            rest=(2.0 - x) * np.cos(half) - y * np.sin(half), taken_in=x[:, 0] > 2.0 + 1e-9,
        )  # fmt: skip
    return panels


def entry(row):
    """A case as a row of the table."""
    q = ", ".join(f"{value:.4f}" for value in row["q"])
    told = [f"error {row['error']:.6f}"]
    if row["rate"] is not None:
        told.append(f"rate {row['rate']:.4g}")
    if row["period"] is not None:
        low, high = row["error_range"]
        told = [f"period {row['period']:.6f} s", f"error {low:.6f} to {high:.6f}"]
        q = "turns"
    return row["case"], row["expected"], row["kind"], q, ", ".join(told)


def four(values):
    """Numbers of the joints and of any, in cells."""
    return [f"{value:.2f}" for value in values]


def degrees(q):
    """Angles in brackets."""
    return f"({', '.join(f'{value:.4f}' for value in q)})"


def tables(found):
    """Ends, basins, maps and what a finite horizon does."""
    basin, whole, brute = found["basins"], found["map"], found["brute_force"]
    shares = [
        (f"{100 * share:.2f} % of the area go to", degrees(q), "")
        for share, q in zip(basin["share"], basin["ends"], strict=True)
    ]
    shares += [
        ("saddle", degrees(q), f"{low:.5f} and {high:.5f}")
        for q, (low, high) in zip(basin["saddles"], basin["eigenvalues"], strict=True)
    ]
    means = [
        (name, *four(mean), " / ".join(f"{value:g}" for value in EXPECTED_MEANS.get(name, ())))
        for name, mean in whole["means"].items()
    ]
    points = [
        (f"{point}", name, *four(whole["printed"][name][k]), " / ".join(f"{value:g}" for value in told))
        for k, (point, expected) in enumerate(EXPECTED_POINTS.items())
        for name, told in zip(("R100", "Ravg"), expected, strict=True)
    ]
    late = [(f"{T:g}", f"{found['horizons'][f'{T:g}']:.1f}", f"{told:g}") for T, told in HORIZONS.items()]
    joints = ("joint 1", "joint 2", "joint 3", "any", "expected")
    return [
        Table(
            title="Ends", headings=("case", "expected", "kind", "q in the end [degrees]", "errors"),
            rows=[entry(row) for row in found["ends"]], text_last=True,
        ),
        Table(title="Basins (Fig. 8)", headings=("", "q [degrees]", "eigenvalues"), rows=shares),
        Table(
            title="Map (Fig. 10)", headings=("mean [%]", *joints), rows=means,
            notes=(
                f"{whole['points']} points, {whole['configurations']} configurations, {whole['failed']} "
                f"lines failed; {whole['seconds']:.1f} s CPU.",
                f"R100 = 100 at {whole['whole']} points (expected 83, 185, 185, 83), > 0 at {whole['some']} "
                "(expected 1568, 1873, 1941, 1318).",
            ),
        ),
        Table(
            title="Points in print", headings=("point", "measure", *joints), rows=points,
            notes=(
                f"Brute force: {brute['runs']} runs from {brute['points']} points in "
                f"{brute['seconds']:.1f} s CPU, {1e6 * brute['seconds'] / brute['runs']:.2f} us each; "
                f"{brute['unresolved']} unresolved, the others of joints 1, 2, 3, any end at the goal in "
                f"{', '.join(f'{value:.4f}' for value in brute['Favg'])} %.",
            ),
        ),
        Table(
            title="What a finite horizon does", headings=("K_e t", "succeeded [%]", "expected"), rows=late,
            notes=(
                "Joint 1 fails at once in range on the self-motion of (-0.9, 1.8); success is an error below "
                "0.01.",
            ),
        ),
    ]  # fmt: skip


if __name__ == "__main__":
    parser = study.options(__doc__, "goel2005", "fewer configurations, a hundredth of the runs")
    add_figures(parser)
    given = parser.parse_args()
    if given.figures is not None:
        sys.exit(drawn_sheets("goel2005", SHEETS, given.figures, given.only))
    found, arrays = maps(given.quick)
    basins_found, fields = figure_8()

    def measured(given):
        """All that the tables show."""
        return {
            "ends": ends(), "basins": basins_found, "map": found, "brute_force": brute_force(given.quick),
            "horizons": horizons(),
        }  # fmt: skip

    title = "Failures that nobody reports (Goel et al. 2005)"
    study.on_record(given, title, measured, tables, LIMITATIONS, figures=pictures(arrays, fields))
