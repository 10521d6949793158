"""Every benchmark runs, and what it times is right; no speed is judged here."""

import json

import pytest
from tests.scripts import ran, told


def test_memory_of_every_stage_adds_up(tmp_path):
    result = json.loads(told("benchmarks/bench_memory.py", "--runs", 1, "--json", "--out", tmp_path))
    assert [row["level"] for row in result["rows"]] == ["velocity", "acceleration"]
    for row in result["rows"]:
        assert list(row["added"]) == ["start", "import", "robot", "first", "further"]
        assert row["added"]["start"] > 0.0 and row["added"]["robot"] > 0.0
        so_far = sum(row["added"][stage] for stage in ("start", "import", "robot", "first"))
        assert abs(so_far - row["one_planner"]) < 0.01
    written = json.loads((tmp_path / "bench_memory.json").read_text())
    assert written.pop("commit") and written == result


def test_arms_of_a_batch_that_are_healthy_keep_to_their_path():
    rows = json.loads(told("benchmarks/bench_batch.py", "--arms", 2, "--ticks", 800, "--json"))["rows"]
    assert [(row["level"], row["fault"]) for row in rows] == [
        ("velocity", False), ("velocity", True), ("acceleration", False), ("acceleration", True),
    ]  # fmt: skip
    assert all(row["steps_per_second"] > 0.0 for row in rows)
    assert all(row["max_position_error"] < 1e-4 for row in rows if not row["fault"])


@pytest.mark.parametrize(
    ("script", "arguments", "said"),
    [
        ("bench_detector", ("--rounds", "0"), "expected at least 1"),
        ("bench_step", ("--ways", "paced,brisk"), "expected some of best, readme, paced"),
        ("bench_step", ("--update-docs",), "needs a full run with --peers"),
        ("bench_step", ("--update-docs", "--peers", "--ways", "paced"), "in every way"),
    ],
)
def test_what_makes_no_sense_is_refused_in_a_sentence(script, arguments, said):
    done = ran(f"benchmarks/{script}.py", *arguments)
    assert done.returncode == 2 and done.stdout == "" and said in done.stderr
