"""The bench is no package of ftqp: its folder joins the path for these tests."""

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "solvers"))
sys.path.append(str(HERE.parents[1]))
"""Processes that tests start find work in ``tests``."""

STUDIES = (
    "test_bench_", "test_compare_", "test_study_", "test_campaign_physics", "test_check_reports",
    "test_detection", "test_environments", "test_goel2005", "test_lock_sets", "test_qpbenchmark_set",
    "test_zhang2016",
)  # fmt: skip
"""Tests that run the script of a study from end to end: ``make test-all`` has them, ``make test`` has not."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them as slow."""
    for item in items:
        if item.path.parent == HERE and item.path.name.startswith(STUDIES):
            item.add_marker(pytest.mark.slow)
