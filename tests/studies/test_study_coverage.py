"""The study of predictions against runs: what counts as agreement, and one case of each end."""

from pathlib import Path

import numpy as np
import pytest
from study_coverage import COLUMNS, Subject, verdicts

CLEAR = {
    "world": "kinematic", "status": "SURVIVED", "margin": 0.5, "hurry": 0.3, "left": 1e-9, "turned_left": 0.0,
    "error": 1e-5, "turned": 1e-5,
}  # fmt: skip
LOST = {"status": "SINGULAR", "left": 0.2, "turned_left": 0.0, "error": 0.3}


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({}, (True, True, False)),
        ({"error": 0.3}, (True, False, False)),
        ({"error": np.inf}, (True, False, False)),
        ({"turned": 0.1}, (True, False, False)),
        ({"margin": 0.009}, (True, True, True)),
        ({"hurry": 0.96}, (True, True, True)),
        ({"error": 1.1e-3}, (True, True, True)),
        (LOST, (False, False, False)),
        (LOST | {"error": 1e-5}, (False, True, False)),
        (LOST | {"left": 3e-3}, (False, False, True)),
    ],
)
def test_a_case_is_clear_unless_prediction_or_run_is_near_its_tolerance(changed, expected):
    assert verdicts(CLEAR | changed) == expected


def test_a_lock_that_is_survived_and_one_that_is_not_end_as_predicted():
    subject = Subject("planar3-line", "as it is", "kinematic", Path())
    for joint, sample, survives in ((2, 100, True), (0, 100, False)):
        row = dict(zip(COLUMNS, subject.case(joint, sample), strict=True))
        assert verdicts(row) == (survives, survives, False)
        assert row["at"] == pytest.approx(2.5)
