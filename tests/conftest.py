"""For all tests: how long a case takes decides nothing, as machines differ; whole scripts are slow."""

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("ftqp", deadline=None)
settings.load_profile("ftqp")

SCRIPTS = [Path(__file__).parent / name for name in ("solvers", "benchmarks", "studies")]
FROM_END_TO_END = (
    "test_bench_", "test_compare_", "test_study_", "test_campaign_physics", "test_check_reports",
    "test_detection", "test_environments", "test_qpbenchmark_set", "test_scripts",
    "test_zhang2016",
)  # fmt: skip
"""Tests that run the script of a study from end to end: ``make test-all`` has them, ``make test`` has not."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them as slow."""
    for item in items:
        if item.path.parent in SCRIPTS and item.path.name.startswith(FROM_END_TO_END):
            item.add_marker(pytest.mark.slow)
