"""What is tested part by part runs as plain Python, in a process of its own; rides are the same compiled."""

import json
import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
HERE = ROOT / "tests" / "kernel" / "plain_python"
COMPARED = (
    "torque_drive_with_an_unresponsive_joint",
    "velocity_drive_that_lags",
    "position_drive_with_a_lead_and_a_sensor_that_drops_out",
    "target_that_runs_away_and_stops_the_arm",
    "modes_and_instant_locks",
    "bounds_for_comparison",
    "torque_limits_that_give_way",
)
"""Rides by the common step, whose machine code is there anyway."""


def plainly(*arguments):
    """What a process says in which nothing is compiled."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    return done.stdout


@pytest.mark.parametrize(
    ("which", "least"), [("not slow", 250), pytest.param("slow", 60, marks=pytest.mark.slow)]
)
def test_parts_of_the_kernel_pass_their_tests_as_plain_python(which, least):
    said = plainly("-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", which, str(HERE))
    counted = re.search(r"(\d+) passed", said)
    assert counted is not None and int(counted[1]) >= least and "skipped" not in said


def numbers(said):
    """All numbers of nested lists."""
    return [x for part in said for x in numbers(part)] if isinstance(said, list) else [float(said)]


@pytest.mark.slow
def test_rides_are_the_same_compiled_and_as_plain_python(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    rides = import_module("rides").RIDES
    plain = json.loads(plainly("-W", "ignore", str(HERE / "rides.py"), *COMPARED).splitlines()[-1])
    assert tuple(plain) == COMPARED
    worst = {}
    for name in COMPARED:
        one, other = np.array(numbers(rides[name]())), np.array(numbers(plain[name]))
        assert one.shape == other.shape, name
        worst[name] = float(np.abs(one - other).max() / max(1.0, np.abs(other).max()))
    assert max(worst.values()) < 1e-9, worst
