"""The pseudoinverse near singularities, and where there is nothing to invert."""

import numpy as np
from reduced_problems import problem, solved

from ftqp.kernel.layout import enums

rng = np.random.default_rng(1)


def test_pseudoinverse_near_and_at_singularity_is_the_truncated_one():
    for smallest in (1e-2, 1e-4, 1e-6, 1e-9, 1e-11, 1e-14, 0.0):
        U = np.linalg.qr(rng.normal(size=(6, 6)))[0]
        V = np.linalg.qr(rng.normal(size=(8, 6)))[0]
        sigma = np.array([3.0, 2.0, 1.0, 0.5, 0.1, smallest])
        y = rng.normal(size=6)
        xdot = U @ (sigma * y)
        x, _ = solved(problem(U @ np.diag(sigma) @ V.T, xdot))
        kept = sigma > 1e-12 * sigma[0]
        assert np.abs(V[:, kept].T @ x - y[kept]).max() < 1e-15 / max(smallest, 3e-12) + 1e-10
        assert np.abs(x - V @ (V.T @ x)).max() < 1e-14 / max(smallest, 3e-12) + 1e-10


def test_no_joint_left_and_a_task_of_rank_zero_give_the_prescribed_rates_and_zeros():
    J, xdot = rng.normal(size=(6, 3)), rng.normal(size=6)
    for method in (enums.PSEUDOINVERSE, enums.DAMPED):
        x, kappa = solved(problem(J, xdot, (0, 1, 2), (0.1, 0.2, 0.3)), method, "row", 1.0)
        assert np.array_equal(x, [0.1, 0.2, 0.3]) and kappa == 0.0
        x, kappa = solved(problem(0.0 * J, xdot), method, "row", 1.0)
        assert not x.any() and kappa == 0.0
