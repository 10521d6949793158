"""The table of a comparison: cells, units, marks, columns that give way."""

from typing import Any

import pytest

from ftqp.app.compare import comparison as comparison_table


def row(label: str = "a", scenario: str = "s", **facts: Any) -> dict[str, Any]:
    """A run that went well, as far as ``facts`` do not say otherwise."""
    return {
        "run": f"{scenario}-{label}",
        "label": {"scenario": scenario, "scheme": "mvn", "backend": label},
        "ran": True,
        "reason": None,
        "robot": "planar6",
        "level": "acceleration",
        "dt": 0.01,
        "steps": 51,
        "completed": True,
        "interrupted": False,
        "stopped_at": None,
        "status_counts": {"OK": 51},
        "max_position_error": 2e-6,
        "rms_position_error": 1e-6,
        "max_limit_violation": {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0},
        "max_failed_joint_motion": {"j2": 0.0},
        "qp": {"iterations_median": 1.0, "iterations_max": 2.0},
        "step_time_us": {"p50": 5.0, "p99": 9.0},
        "faults": [],
    } | facts


def cells(rows: list[dict[str, Any]]) -> dict[str, tuple[str, ...]]:
    """The whole table by heading."""
    why = comparison_table.reasons(rows)
    return {column.line: column.cells for column in comparison_table.columns(rows, why)}


def test_the_best_completed_run_is_marked_by_a_sign() -> None:
    table = cells(
        [row("a"), row("b", max_position_error=1e-6), row("c", max_position_error=5e-7, completed=False)]
    )
    assert table["max error [um]"] == ("2 ", "1*", "0.5 ")


def test_exceeded_limits_stopping_and_counts_are_told() -> None:
    bad = row(
        "b",
        completed=False,
        stopped_at=16.83,
        status_counts={"OK": 1, "RELAXED": 12, "FALLBACK": 3},
        max_limit_violation={"q": 0.0, "v": 1e-10, "a": 0.012, "tau": 3.0},
        max_failed_joint_motion={"j1": 0.0, "j2": 0.25},
    )
    table = cells([row(), bad])
    assert table["result"] == ("completed", "stopped at 16.83 s")
    assert table["limits"] == ("kept", "a by 0.012, tau by 3")
    assert table["relaxed/fallback"] == ("0/0", "12/3")
    assert table["failed joint moved [rad]"] == ("0", "0.25")
    assert table["QP iterations median/max"] == ("1/2", "1/2")


def test_a_run_that_could_not_be_made_has_the_number_of_its_reason() -> None:
    absent = {key: row("b")[key] for key in ("run", "label")} | {"ran": False, "reason": "no gurobi"}
    rows = [row(), absent | {"completed": False}]
    assert cells(rows)["result"] == ("completed", "not run (1)")
    assert cells(rows)["max error [um]"] == ("2", "-")
    assert "(1) no gurobi" in comparison_table.notes(rows)
    assert "no gurobi" in comparison_table.markdown(rows, [])


@pytest.mark.parametrize("width", [80, 200])
def test_a_table_is_no_wider_than_the_terminal(width: int) -> None:
    stopped = {
        "completed": False,
        "stopped_at": 16.83,
        "status_counts": {"RELAXED": 12345, "FALLBACK": 12345},
    }
    rows = [row("active_set"), row("qpsolvers:clarabel", **stopped)]
    shown, gone = comparison_table.fitting(comparison_table.columns(rows, []), width)
    assert sum(column.width for column in shown) + 2 * (len(shown) - 1) <= width
    names = [column.name for column in shown]
    assert {"backend", "result", "max error", "step p50"} <= set(names)
    assert bool(gone) == (width < 200)
