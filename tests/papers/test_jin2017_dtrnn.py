"""Jin et al. 2017 with the recurrent network in the loop: experiments E5 and E10.

The table of iterations is in ``tests/solvers/test_study_dtrnn.py``, in full in ``solvers/study_dtrnn.py``.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.papers.jin2017 import Run, run

import ftqp
import ftqp.qp.dtrnn
from ftqp.core.checks import FloatArray

LOCK = (15.0, ftqp.Locked(0, mode="instant"))
PAPER: dict[str, Any] = {"name": "dtrnn", "mode": "paper"}


@cache
def in_the_loop(method: str, scaling: bool) -> Run:
    """The square with joint 1 locked at 15 s, the network in paper mode: |e| <= 1e-5, warm, cap 20 000."""
    return run(faults=(LOCK,), backend={**PAPER, "method": method, "scaling": scaling})


@cache
def recorded() -> ftqp.qp.Recording:
    """Every QP of that run with the active set."""
    recorder = ftqp.qp.Recorder("active_set")
    run(faults=(LOCK,), backend=recorder)
    return recorder.recording(dt=0.01)


@pytest.mark.parametrize(("method", "scaling", "error"), [("94lvi", False, 1e-5), ("implicit", True, 4.5e-6)])
def test_the_network_in_the_loop_follows_the_square(method: str, scaling: bool, error: float) -> None:
    ended = in_the_loop(method, scaling)
    assert ended.count(ftqp.StepStatus.OK) == len(ended.t)
    assert ended.error.max() <= error
    assert (ended.v[1501:, 0] == 0.0).all() and (ended.tau[1501:, 0] == 0.0).all()


def test_the_paper_s_stop_costs_accuracy_in_the_loop() -> None:
    exact = run(faults=(LOCK,))
    assert exact.error.max() < 4e-6
    assert in_the_loop("94lvi", False).error.max() > 1.5 * exact.error.max()


@pytest.mark.parametrize("method", ["implicit", "94lvi", "e47"])
def test_the_network_with_jumps_agrees_with_the_active_set_on_every_qp(method: str) -> None:
    recording = recorded()
    worst = 0.0
    for k in range(0, len(recording), 5):
        answer = ftqp.qp.dtrnn.solve(recording.problem(k), method)
        assert answer.status is ftqp.qp.SolveStatus.SOLVED
        worst = max(worst, float(np.abs(answer.x - recording.x[k]).max()))
    assert worst <= 1e-9


def test_a_small_residual_does_not_bound_the_error_of_x() -> None:
    recording = recorded()
    errors: list[float] = []
    for k in range(0, len(recording), 50):
        x: FloatArray = ftqp.qp.dtrnn.solve(recording.problem(k), "implicit", mode="paper", scaling=True).x
        errors.append(float(np.abs(x - recording.x[k]).max()))
    assert 1e-5 < max(errors) < 1e-2
