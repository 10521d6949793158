"""Comparisons with peers run; ftqp ends where it is asked, and examples of several tasks are short."""

import json

import numpy as np
import pytest
from compare_peers import drawn, feasible, judged
from compare_tasks import EXAMPLES, errors, lines, posed
from posed import with_ftqp
from tests.scripts import told


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_task_of_an_example_is_kept_and_no_peer_needs_fewer_lines(example):
    robot, q, goals = posed(example)
    end = getattr(with_ftqp, example)(robot, q, goals, 1500)
    assert errors(example, robot, q, end, goals) < 1e-3 < errors(example, robot, q, q, goals)
    assert all(lines("ftqp", example) <= (lines(peer, example) or 99) for peer in ("pink", "placo"))


PROGRAMS = ("ftqp step", "ftqp GoTo", "damped least squares")


def test_programs_of_this_environment_are_compared_on_both_kinds() -> None:
    rows = json.loads(told("benchmarks/compare_peers.py", "--cases", 1, "--json", "--only", *PROGRAMS))[
        "rows"
    ]
    assert [(row["kind"], row["program"]) for row in rows] == [
        ("path", "ftqp step"), ("path", "damped least squares"),
        ("goal", "ftqp GoTo"), ("goal", "damped least squares"),
    ]  # fmt: skip
    for row in rows:
        counted = [count for _, count in row["finished"].values()]
        assert sum(counted) == row["cases"] == 4 and row["raised"] == 0
        if row["program"].startswith("ftqp"):
            assert row["beyond_a"] == row["beyond_v"] == row["beyond_q"] == row["moved_locked"] == 0


def test_an_arm_that_stands_has_finished_nothing_and_broken_nothing() -> None:
    case, arm = drawn("panda", "path", 0)
    assert feasible(case, arm, 250) in ("straight", "other posture", "not known")
    stands = np.tile(case.q, (case.steps + 1, 1))
    verdict = judged(case, arm, stands)
    assert not verdict["finished"] and verdict["rests"]
    assert not any(verdict[key] for key in ("beyond_q", "beyond_v", "beyond_a", "moved_locked"))
    stands[100:, case.locked] += 1e-3
    assert judged(case, arm, stands)["moved_locked"] and judged(case, arm, stands)["beyond_a"]
