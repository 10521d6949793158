"""Errors of a scenario: one sentence each, with the path in the file, all at once."""

from typing import Any

import pytest

from ftqp.app.schema import Scenario
from ftqp.app.schema.reading import read
from ftqp.core.errors import ScenarioError


def reported_at(**changes: Any) -> tuple[str, ...]:
    """What is said of a valid scenario with changes."""
    content: dict[str, Any] = {
        "robot": {"name": "panda"},
        "path": {"kind": "circle", "radius": 0.1, "duration": 1.0},
    }
    content |= changes
    try:
        read(Scenario, content, "it has errors:")
    except ScenarioError as error:
        return error.errors
    return ()


CIRCLE = {"kind": "circle", "duration": 1.0}
LOCK = {"kind": "locked", "joint": 0, "at": 2.0}
SENTENCES: list[tuple[dict[str, Any], str]] = [
    (
        {"path": CIRCLE | {"radius": 0.1, "turn": 2}},
        "path.turn is not a key of [path] (did you mean 'turns'?)",
    ),
    (
        {"faults": [{"joint": 0, "at": 1.0}]},
        "faults[0] is missing its kind, expected one of locked, free_swinging, degraded",
    ),
    ({"path": CIRCLE}, "path.radius is missing; it is the radius r, > 0 [m]"),
    (
        {"planner": {"level": "velocty"}},
        "planner.level is 'velocty', expected one of acceleration, velocity (did you mean 'velocity'?)",
    ),
    ({"planner": {"solver": "daqp"}}, "planner.solver is not a key of [planner] (did you mean 'backend'?)"),
    (
        {"faults": [LOCK | {"announced": "nevr"}]},
        "faults[0].announced is 'nevr'; it is when it is reported",
    ),
    ({"faults": [LOCK | {"announced": 1.0}]}, "faults[0] is announced at 1 s, before it happens at 2 s"),
    ({"robot": {}}, "robot names no robot, expected exactly one of name, urdf, mjcf, dh"),
    ({"robot": {"name": "panda", "urdf": "a.urdf"}}, "robot has name and urdf, expected exactly one of"),
    (
        {"planner": {"backend": "daqp", "profile": "x"}},
        "planner has backend and profile, expected one of them",
    ),
]


def test_a_valid_scenario_has_no_errors() -> None:
    assert reported_at() == ()


@pytest.mark.parametrize(("changes", "beginning"), SENTENCES, ids=[text for _, text in SENTENCES])
def test_what_is_wrong_is_one_sentence_with_its_place(changes: dict[str, Any], beginning: str) -> None:
    (sentence,) = reported_at(**changes)
    assert sentence.startswith(beginning)


def test_tables_given_as_values_are_refused() -> None:
    sentences = reported_at(robot=3, path="circle", planner=[], faults=3)
    assert [sentence.partition(" ")[0] for sentence in sentences] == ["robot", "planner", "path", "faults"]
    assert all("expected a table" in sentence or "expected a list" in sentence for sentence in sentences)


def test_all_errors_are_told_at_once() -> None:
    sentences = reported_at(
        robot={"name": "panda", "tipp": "x"},
        planner={"dt": 0, "level": "x"},
        start={"q": [0.0, "a"]},
        simulation={"seed": -1},
    )
    assert [sentence.partition(" ")[0] for sentence in sentences] == [
        "robot.tipp",
        "planner.dt",
        "planner.level",
        "start.q[1]",
        "simulation.seed",
    ]


def test_a_flood_of_errors_is_cut_short() -> None:
    sentences = reported_at(**{f"key{index}": 1 for index in range(1000)})
    assert len(sentences) == 101
    assert sentences[-1] == "and 900 more"
