"""A plugin for pytest, ``-p mutating.plain_python``: how tests run where nothing is compiled.

A tick takes some hundred times as long as plain Python. So each test may take so many seconds of CPU time and
is skipped beyond them, a test with many parameters runs with some of them, hypothesis tries few examples, and
the reserve of braking is made of few samples.
"""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

import ftqp
from ftqp.control.planner import braking_reserve

SECONDS = "FTQP_PLAIN_SECONDS"
"""The environment variable with the CPU seconds that a test may take."""
EXAMPLES = 4
"""Examples of hypothesis."""
CASES = 8
"""Sets of parameters with which a test runs at most, the first and the last among them ..."""
WHOLE = "plain_python"
"""... unless it lies in a folder of this name, and is made for plain Python: then it takes its time, too."""
AGAIN = 0.01
"""CPU seconds after which a test that could not be skipped is to be."""
SAMPLES = 6
"""Samples of ``BrakingReserve``, instead of 400."""

braking_reserve.SAMPLES = SAMPLES


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Skip the test when its CPU time is over.

    Not in the middle of coverage.py's own code, which would then hold its lock for good.
    """

    def over(_: int, frame: FrameType | None) -> None:
        if frame is not None and "coverage" in Path(frame.f_code.co_filename).parent.name:
            signal.setitimer(signal.ITIMER_PROF, AGAIN)
            return
        pytest.skip("takes too long as plain Python")

    before = signal.signal(signal.SIGPROF, over)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def is_whole(item: pytest.Item) -> bool:
    """Whether nothing is left out of a test."""
    return WHOLE in item.path.parts


def pytest_sessionstart() -> None:
    """What is imported at a first step is imported here: no test may be cut short in the middle of that."""
    for level in ("acceleration", "velocity"):
        robot = ftqp.robots.load("planar", count=3)
        planner = ftqp.Planner(robot, 0.01, level=level)
        planner.reset(robot.neutral)
        planner.step(robot.neutral, np.zeros(robot.nv), ftqp.Target(pose=robot.pose(robot.neutral)))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Any:
    """A test, as long as it may take."""
    with limited(float(os.environ.get(SECONDS, "3")) * (100.0 if is_whole(item) else 1.0)):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup() -> Any:
    """What a test needs, likewise."""
    with limited(float(os.environ.get(SECONDS, "3"))):
        return (yield)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Few sets of parameters and few examples, always the same."""
    groups: dict[str, list[pytest.Item]] = {}
    for item in items:
        groups.setdefault(item.nodeid.partition("[")[0], []).append(item)
    kept: set[str] = set()
    for group in groups.values():
        last = len(group) - 1
        if is_whole(group[0]):
            kept |= {item.nodeid for item in group}
        kept |= {group[round(k * last / (CASES - 1))].nodeid for k in range(CASES)}
    config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in kept])
    items[:] = [item for item in items if item.nodeid in kept]
    for item in items:
        function = getattr(item, "obj", None)
        function = getattr(function, "__func__", function)
        chosen = getattr(function, "_hypothesis_internal_use_settings", None)
        if chosen is not None:
            function._hypothesis_internal_use_settings = settings(  # type: ignore[union-attr]
                chosen, max_examples=EXAMPLES, deadline=None, database=None, derandomize=True
            )
