"""The study of plans that are executed: every motion gets the same locks, and what counts as survived."""

from pathlib import Path

from study_coverage import OWN, Subject
from study_executions import COLUMNS, Executions, summed_up


def test_every_motion_gets_the_same_locks():
    subjects = tuple(Subject("planar3-line", OWN, "kinematic", Path()) for _ in range(2))
    (first,), (second,) = (Executions(1, 3, subjects)([item]) for item in (2, 5))
    assert first == second and len(first) == len(COLUMNS)
    assert first[2:4] != Executions(1, 3, subjects)([0])[0][2:4]


def test_a_run_that_comes_back_late_counts_from_a_second_on_only():
    good = {"predicted": "SURVIVED", "error": 1e-5, "turned": 0.0, "error_later": 1e-6, "turned_later": 0.0}
    late = good | {"error": 3e-3}
    lost = dict.fromkeys(good, 0.1) | {"predicted": "LIMIT", "ended": "stopped"}
    common = {"scenario": "a", "motion": "dp", "joint": 1, "at": 2.0, "ended": "OK"}
    rows = [[k, *((common | one)[name] for name in COLUMNS)] for k, one in enumerate((good, late, lost))]
    (found,) = summed_up(rows)
    counted = [found[name] for name in ("cases", "predicted", "ran", "ran_later", "stopped")]
    assert counted == [3, 2, 1, 2, 1]
