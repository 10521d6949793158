"""Errors of a scenario: one sentence each, with the path in the file, all at once."""

from typing import Any

import pytest

from ftqp.app.schema import Scenario
from ftqp.app.schema.reading import read
from ftqp.core.errors import ScenarioError


def told(**changes: Any) -> tuple[str, ...]:
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


def test_a_valid_scenario_has_no_errors() -> None:
    assert told() == ()


def test_unknown_table_is_answered_with_the_nearest() -> None:
    (sentence,) = told(plannr={})
    assert sentence.startswith(
        "plannr is not a key of a scenario (did you mean 'planner'?); it has description, robot"
    )


def test_unknown_key_of_a_union_has_the_path_of_the_file() -> None:
    (sentence,) = told(path={"kind": "circle", "radius": 0.1, "duration": 1.0, "turn": 2})
    assert sentence.startswith("path.turn is not a key of [path] (did you mean 'turns'?)")


def test_unknown_kind_names_the_kinds_and_the_nearest() -> None:
    (sentence,) = told(path={"kind": "circel"})
    assert sentence.startswith("path has kind 'circel', expected one of line, square, circle")
    assert "did you mean 'circle'?" in sentence


def test_missing_kind_is_said() -> None:
    (sentence,) = told(faults=[{"joint": 0, "at": 1.0}])
    assert sentence == "faults[0] is missing its kind, expected one of locked, free_swinging, degraded"


def test_missing_key_is_said_with_its_meaning() -> None:
    (sentence,) = told(path={"kind": "circle", "duration": 1.0})
    assert sentence == "path.radius is missing; it is radius, > 0 [m]"


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (0, "planner.dt is 0, expected a number greater than 0 [s]"),
        (-1e-3, "planner.dt is -0.001, expected a number greater than 0 [s]"),
        (2.0, "planner.dt is 2.0, expected a number at most 1 [s]"),
        (float("nan"), "planner.dt is nan, expected a finite number [s]"),
        (float("inf"), "planner.dt is inf, expected a finite number [s]"),
        ("0.001", "planner.dt is '0.001', expected a number [s]"),
        (True, "planner.dt is True, expected a number [s]"),
        ([1], "planner.dt is [1], expected a number [s]"),
    ],
)
def test_bad_number_is_said_with_its_range_and_unit(value: object, sentence: str) -> None:
    assert told(planner={"dt": value}) == (sentence,)


def test_bad_choice_names_the_choices_and_the_nearest() -> None:
    (sentence,) = told(planner={"level": "velocty"})
    assert sentence == (
        "planner.level is 'velocty', expected one of acceleration, velocity (did you mean 'velocity'?)"
    )


def test_bad_choice_between_types_is_said_once() -> None:
    (sentence,) = told(faults=[{"kind": "locked", "joint": 0, "at": 1.0, "announced": "nevr"}])
    assert sentence.startswith("faults[0].announced is 'nevr'; it is when the planner is told")


def test_announcement_before_the_fault_is_refused() -> None:
    (sentence,) = told(faults=[{"kind": "locked", "joint": 0, "at": 2.0, "announced": 1.0}])
    assert sentence == "faults[0] is announced at 1 s, before it happens at 2 s"


@pytest.mark.parametrize(
    ("robot", "got"), [({}, "names no robot"), ({"name": "panda", "urdf": "a.urdf"}, "has name and urdf")]
)
def test_robot_has_exactly_one_source(robot: dict[str, Any], got: str) -> None:
    assert told(robot=robot) == (f"robot {got}, expected exactly one of name, urdf, mjcf, dh",)


def test_backend_and_profile_exclude_each_other() -> None:
    (sentence,) = told(planner={"backend": "daqp", "profile": "x.toml"})
    assert sentence == "planner has backend and profile, expected one of them"


def test_nan_limit_is_refused_and_infinite_limit_means_none() -> None:
    (sentence,) = told(robot={"name": "panda", "limits": {"v_max": [float("inf"), float("nan")]}})
    assert sentence == "robot.limits.v_max[1] is nan, expected a number (inf for no limit)"


def test_wrong_length_of_a_vector_is_said() -> None:
    assert told(path={"kind": "line", "displacement": [1.0, 2.0], "duration": 1.0}) == (
        "path.displacement has 2 entries, expected at least 3 [m]",
    )


def test_tables_given_as_values_are_refused() -> None:
    sentences = told(robot=3, path="circle", planner=[], faults=3)
    assert [sentence.partition(" ")[0] for sentence in sentences] == ["robot", "planner", "path", "faults"]
    assert all("expected a table" in sentence or "expected a list" in sentence for sentence in sentences)


def test_all_errors_are_told_at_once() -> None:
    sentences = told(
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
    sentences = told(**{f"key{index}": 1 for index in range(1000)})
    assert len(sentences) == 101
    assert sentences[-1] == "and 900 more"
