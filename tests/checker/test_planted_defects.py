"""The judge is judged: each defect that is planted into the planner is found, and nothing without one."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SHOWN_BY = {
    "clamp off": "speed",
    "a locked column kept": "tracking",
    "viability off": "braking",
    "status forced to OK": "honesty",
}


@pytest.fixture(scope="module")
def found():
    script = Path(__file__).with_name("planted_defects.py")
    plain = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, env=plain, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return json.loads(ended.stdout)


@pytest.mark.parametrize("defect", SHOWN_BY)
def test_planted_defect_is_found(found, defect):
    assert SHOWN_BY[defect] in found[defect]["with"]


@pytest.mark.parametrize("defect", SHOWN_BY)
def test_planner_without_the_defect_is_found_innocent(found, defect):
    assert found[defect]["without"] == []
