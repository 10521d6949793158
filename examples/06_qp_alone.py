"""A QP without a robot: minimise 1/2 x'Hx + g'x with Ax = b and lb <= x <= ub.

The solution's cost, its worst residual, and the multiplier of the bound that is active.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

problem = ftqp.QP(
    H=np.diag([1.0, 2.0, 3.0]),
    g=np.array([-1.0, -1.0, -0.25]),
    A=np.array([[1.0, 1.0, 1.0]]),
    b=np.array([1.0]),
    lb=np.zeros(3),
    ub=np.array([0.5, 1.0, 1.0]),
)
solution = ftqp.qp.solve(problem)

x = solution.x
print(f"cost: {0.5 * x @ problem.H @ x + problem.g @ x:.6f}")
print(f"worst primal residual: {solution.residuals.primal:.1e}")
print(f"multiplier of x0 <= 0.5: {solution.z_box[0]:.6f}")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    bounds, found = np.linspace(0.1, 1.0, 91), []
    for bound in bounds:
        ub = np.array([bound, 1.0, 1.0])
        other = ftqp.QP(H=problem.H, g=problem.g, A=problem.A, b=problem.b, lb=problem.lb, ub=ub)
        found.append(ftqp.qp.solve(other).x)
    lines = {f"x{i}": (bounds, values) for i, values in enumerate(np.transpose(found))}
    title = "The solution as the bound of x0 moves"
    draw_loop(given.figure, title, {"x": lines}, x_label="upper bound of x0")
