"""Every profile of the bench loads strictly, says what it trades, and solves."""

from pathlib import Path

import numpy as np
import pytest
from bench.contenders import PROFILES
from tests.solvers.stand_ins import SOLVABLE, sequence

from ftqp.core.errors import MissingPackage
from ftqp.qp import backend, backend_names, backends, residuals
from ftqp.qp.adapters.registry import profile
from ftqp.qp.answer_check import scales

FILES = sorted(PROFILES.glob("*.toml"))
ROOT = Path(__file__).resolve().parents[2]
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


def test_fast_profiles_are_not_tighter_than_accurate_ones() -> None:
    pairs = [
        (file, PROFILES / file.name.replace("fast", "accurate")) for file in FILES if "fast" in file.stem
    ]
    assert len(pairs) >= 5
    for file, partner in pairs:
        fast, accurate = profile(file), profile(partner)
        assert fast != accurate
        assert fast["name"] == accurate["name"]
        tolerances = [key for key in fast if "tol" in key or key.startswith("eps")]
        caps = [key for key in fast if key.startswith("max_")]
        assert all(fast[key] >= accurate[key] for key in tolerances)
        assert any(fast[key] > accurate[key] for key in tolerances)
        assert caps
        assert all(fast[key] <= accurate[key] for key in caps)


def test_every_backend_of_its_own_has_a_profile() -> None:
    named = {profile(file)["name"] for file in FILES}
    assert {name for name in backend_names() if "<" not in name} <= named


def test_the_readme_gives_the_licence_of_every_backend_that_has_a_profile() -> None:
    text = (ROOT / "solvers" / "README.md").read_text(encoding="utf-8")
    licences = {info.name: info.licence for info in backends()}
    for name in {profile(file)["name"] for file in FILES}:
        row = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert licences.get(name, "LGPL-3.0") in row
