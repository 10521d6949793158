"""The benchmark of the closed forms runs, and the damped variants are damped."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "benchmarks" / "bench_closed_form.py"


def test_quick_run_prints_every_scheme_and_damps_where_it_says_so():
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--quick"], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert result["ratio_to_qp_same_input"]["mvn, slow"] == 1.0
    for key, damped in result["damped"].items():
        expected = key.startswith("singularity_robust") and ("own limits" not in key or "fast" in key)
        assert damped == expected, key
