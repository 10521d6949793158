"""What happened in a run, in words."""

import pytest

from ftqp.app.output.words import ending, fault_sentence, limits_sentence


def test_rounding_is_no_exceeded_limit() -> None:
    assert limits_sentence({"q": 1e-12, "v": 0.0, "a": 0.0, "tau": 0.0}) == "every limit was kept"


def test_every_exceeded_limit_is_named_with_its_excess() -> None:
    said = limits_sentence({"q": 0.01, "v": 0.0, "a": 0.0, "tau": 2.0})
    assert said == "limits exceeded: position by 0.01, torque by 2"


@pytest.mark.parametrize(
    ("kind", "announced", "sentence"),
    [
        ("locked", 2.0, "j1 locks at 2 s; the planner is told at once"),
        ("free_swinging", 2.5, "j1 swings freely at 2 s; the planner is told at 2.5 s"),
        ("degraded", None, "j1 is degraded at 2 s; the planner is never told"),
    ],
)
def test_fault_tells_what_when_and_who_knows(kind: str, announced: float | None, sentence: str) -> None:
    assert fault_sentence({"kind": kind, "joint": "j1", "at": 2.0, "announced": announced}) == sentence


def test_ending_tells_interruption_completion_and_stop_apart() -> None:
    facts = {
        "status_counts": {"OK": 1, "STOPPED": 2},
        "steps": 3,
        "interrupted": False,
        "completed": False,
        "stopped_at": 1.5,
        "final_status": "STOPPED",
    }
    assert ending(facts | {"interrupted": True}) == "interrupted after 3 steps"
    assert ending(facts | {"completed": True}) == "completed in 3 steps"
    partly = {"completed": True, "status_counts": {"OK": 1, "RELAXED": 2}}
    assert ending(facts | partly) == "completed in 3 steps, 2 of them RELAXED: the task was kept in part"
    assert ending(facts) == "stopped at 1.50 s: the task could not go on"
