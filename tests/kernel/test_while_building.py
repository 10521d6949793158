"""What helpers do as compiled code is tested in a process where helpers are compiled."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("numba")
ROOT = Path(__file__).resolve().parents[2]
FILES = (
    "maths/test_side_by_side.py",
    "layout/test_record.py",
    "rows/test_joint_intervals.py",
    "test_jit.py::test_rounding_stays_as_written_whoever_calls",
)


@pytest.mark.slow
def test_helpers_pass_their_tests_as_compiled_code():
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow",
         *(str(ROOT / "tests" / "kernel" / file) for file in FILES)],
        cwd=ROOT,
        env={**os.environ, "FTQP_BUILD_KERNEL": "1", "PYTHONPATH": str(ROOT / "src")},
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, (done.stdout + done.stderr)[-4000:]
    counted = re.search(r"(\d+) passed", done.stdout)
    assert counted is not None and int(counted[1]) >= 30 and "skipped" not in done.stdout, done.stdout[-500:]
