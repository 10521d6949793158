"""The recorded sequences hold what their table says, and are what the planner makes today."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from comparison.sequences import FOLDER, feasible, sequences

from ftqp.qp import Recording, residuals
from ftqp.qp.solving import infeasibility, scales


@pytest.fixture(scope="module")
def everything() -> dict[str, Recording]:
    return sequences()


def test_reference_answers_solve_their_qps(everything: dict[str, Recording]) -> None:
    for name, recording in everything.items():
        for k, problem in enumerate(recording):
            if not feasible(recording)[k]:
                assert np.isnan(recording.x[k]).all(), name
                continue
            x, y, z, z_box = (part[k] for part in (recording.x, recording.y, recording.z, recording.z_box))
            found = residuals(problem, x, y, z, z_box)
            values = np.array([found.primal, found.dual, found.complementarity, found.gap])
            assert (values <= 1e-10 * scales(problem, x, y)).all(), (name, k)


def test_infeasible_qps_are_proven_to_be(everything: dict[str, Recording]) -> None:
    count = 0
    for name, recording in everything.items():
        for k in np.flatnonzero(~feasible(recording)):
            assert infeasibility(recording.problem(int(k))) is not None, (name, k)
            count += 1
    assert count > 80


@pytest.mark.slow
def test_script_makes_the_recorded_sequences_again(tmp_path: Path) -> None:
    chosen = ["planar6-infeasible", "puma560-near-singular"]
    script = [sys.executable, str(FOLDER / "record.py"), "--quick", "--out", str(tmp_path), "--only", *chosen]
    done = subprocess.run(script, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    for name, again in sequences(chosen, folder=tmp_path).items():
        stored = sequences([name])[name].part(0, len(again))
        assert again.variables == stored.variables
        for part in ("H", "g", "A", "b", "lb", "ub"):
            np.testing.assert_allclose(getattr(again, part), getattr(stored, part), rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(again.x, stored.x, rtol=1e-5, atol=1e-7)
