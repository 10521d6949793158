"""A joint locks unreported: a law that adapts to the end effector's motion, and one that does not.

The law of Goel et al. 2005 rests far from its goal. One that identifies which joint does nothing gets as
near as it can. With --all, every case of the paper.
"""

import argparse

import numpy as np

import ftqp

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--headless", action="store_true", help="no windows")
parser.add_argument("--all", action="store_true", help="every case of the paper")
parser.add_argument("--figure", metavar="FILE", help="save a picture here")
options = parser.parse_args()

C, S = np.cos(np.deg2rad([45, 120, 60])), np.sin(np.deg2rad([45, 120, 60]))
CASES = {
    "3R, joint 1 at 150 degrees": ((150.0, -107.9446, 98.8833), "j1", (1.5, 1.5)),
    "2R, goal A": ((0.0, -30.0), "j1", (1.0 + C[0], S[0])),
    "2R, goal B": ((0.0, -30.0), "j1", (2.0, 0.0)),
    "2R, goal C": ((0.0, -30.0), "j1", (1.0 + 2.0 * C[1], 2.0 * S[1])),
    "2R, goal D": ((0.0, -30.0), "j1", (1.0 + 2.0 * C[2], 2.0 * S[2])),
    "3R, Fig. 5, first start": ((-79.3348, 45.0, 42.7735), "j2", (1.5, 1.5)),
    "3R, Fig. 5, second start": ((-35.6493, 45.0, -87.7735), "j2", (1.5, 1.5)),
    "3R, Fig. 6": ((106.8745, -39.652, 117.3062), "j1", (1.5, 1.5)),
    "3R, Fig. 7": ((10.8852, 72.5087, 30.0), "j3", (-0.8, 0.0)),
}


def run(case: str, learns: bool) -> "ftqp.analysis.LearnedRun":
    start, joint, goal = CASES[case]
    robot = ftqp.robots.load("planar", lengths=[1.0] * len(start), continuous=True)
    return ftqp.analysis.learned_run(robot, goal, np.deg2rad(start), [joint], learns=learns)


first = next(iter(CASES))
runs = {"as it is": run(first, learns=False), "adapting": run(first, learns=True)}
plain, learned = runs.values()
print(f"the law as it is ends: {plain.error:.4f} m from the goal")
print(f"the law that adapts ends: {learned.error:.4f} m from it, as near as the remaining joints can")
print(f"estimate of the locked joint's motion: {learned.theta[0]:.2f} of its commands")
for case in list(CASES) if options.all else ():
    plain, learned = run(case, learns=False), run(case, learns=True)
    last = plain.errors[len(plain.errors) // 2 :]
    moving = f", moving between {last.min():.2f} and {last.max():.2f}" if np.ptp(last) > 0.01 else ""
    print(f"{case}: {plain.error:.4f} m as it is{moving}; {learned.error:.4f} m adapting")

if options.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    curves = {name: (np.arange(len(one.errors)), one.errors) for name, one in runs.items()}
    title, label = "A lock that nobody noticed", "from the goal [m]"
    draw_loop(options.figure, title, {label: curves}, x_label="step of the law")
