"""The study of predictions against runs: what counts as agreement, and one case of each end."""

from pathlib import Path

import pytest
from study_coverage import COLUMNS, Subject, verdicts


def test_a_lock_that_is_survived_and_one_that_is_not_end_as_predicted():
    subject = Subject("planar3-line", "as it is", "kinematic", Path())
    for joint, sample, survives in ((2, 100, True), (0, 100, False)):
        row = dict(zip(COLUMNS, subject.case(joint, sample), strict=True))
        assert verdicts(row) == (survives, survives, False)
        assert row["at"] == pytest.approx(2.5)
