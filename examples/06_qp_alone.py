"""A QP without a robot: minimise 1/2 x'Hx + g'x with Ax = b and lb <= x <= ub.

You will see the solution's cost, its worst residual, and the multiplier of the bound that is active.
"""

import argparse

import numpy as np

import ftqp

argparse.ArgumentParser(description=__doc__).add_argument(
    "--headless", action="store_true", help="no windows"
)

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
