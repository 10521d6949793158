"""Every profile of the bench loads strictly, says what it trades, and solves."""

from pathlib import Path

import numpy as np
import pytest
from bench.contenders import PROFILES
from tests.solvers.stand_ins import SOLVABLE, sequence

from ftqp.core.errors import MissingPackage
from ftqp.qp import backend, residuals
from ftqp.qp.solving import scales

FILES = sorted(PROFILES.glob("*.toml"))
PAPER = 1e-4
"""What the paper's stopping rule of 1e-5 leaves of a residual."""


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_profile_solves_a_qp_with_active_bounds_cold_and_warm(file: Path) -> None:
    try:
        solver = backend(file)
    except MissingPackage as error:
        pytest.skip(f'needs pip install -e ".[solvers]": {error}')
    qp = sequence(SOLVABLE).buffers()
    solver.setup(qp)
    for cold in (True, False):
        qp.g[:] = [-3.0, 3.0 - 0.1 * cold]
        solver.solve(cold=cold)
        found = residuals(qp, qp.x, qp.y, qp.z, qp.z_box)
        values = np.array([found.primal, found.dual, found.complementarity, found.gap])
        relative = (values / scales(qp, qp.x, qp.y)).max()
        assert relative <= (PAPER if "paper" in file.stem else 1e-6)
