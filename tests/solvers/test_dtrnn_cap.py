"""The study of the network's cap: every QP has a solution, and the texts have the figures of the report."""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_every_qp_of_the_study_has_a_solution_and_some_end_at_the_cap() -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "solvers" / "dtrnn_cap.py"), "--count", "20", "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    for row in found["rows"]:
        assert row["active_set"] == row["count"] == 20 and set(row["ends"]) <= {"SOLVED", "MAX_ITERATIONS"}
        assert row["condition"] > 100.0 or row["ends"] == {"SOLVED": 20}
    assert found["ill_conditioned"] == 180 and 0 < found["capped"] < 90


def test_texts_have_the_figures_of_the_report() -> None:
    report = (ROOT / "solvers" / "results" / "dtrnn_cap.md").read_text(encoding="utf-8")
    at_cap, of, percent = re.search(r"1e8: (\d+) of (\d+) at the cap, (\d+) %", report).groups()
    page = (ROOT / "docs" / "theory" / "recurrent-network.md").read_text(encoding="utf-8")
    assert f"{at_cap} of {of} ({percent} %)" in page
    assert f"on {percent} % of feasible QPs" in (ROOT / "docs" / "promises.md").read_text(encoding="utf-8")
    assert f"{at_cap} of {of}" in (ROOT / "solvers" / "README.md").read_text(encoding="utf-8")
