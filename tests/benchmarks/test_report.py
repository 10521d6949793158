"""What is said of the step: ratios by way, and what is missed."""

from typing import Any

from bench.ways import WAYS
from steps import report
from steps.report import GOALS, OURS, REFERENCE, TASKS


def case(task: str, way: str, ours: float, *, locked: bool = False, tail: float = 2.0) -> dict[str, Any]:
    """A case in which placo's p50 is 10 us and its p99.9 20 us."""
    robot, level = task.split("_")
    times = {OURS: (ours, tail), REFERENCE: (10.0, 2.0)}
    return {
        "robot": robot,
        "level": level,
        "locked": "j1" if locked else None,
        "way": way,
        "variants": {name: {"p50": p50, "p999": p50 * by, "tail": by} for name, (p50, by) in times.items()},
    }


def measured(ours: dict[str, float], tail: float = 2.0) -> dict[str, Any]:
    """A result in which every task takes so many microseconds in each way, and one more when locked."""
    cases = [
        case(task, way, ours[way] + locked, locked=locked, tail=tail)
        for task in TASKS
        for way in WAYS
        for locked in (False, True)
    ]
    return {**report.ratios(cases), "cases": cases}


def test_every_way_has_ratios_of_its_own() -> None:
    result = measured({"best": 1.0, "readme": 2.0, "paced": 4.0})
    for suffix, ratio in (("", 0.1), ("_readme", 0.2), ("_paced", 0.4)):
        assert result[f"ratios_to_placo{suffix}"] == dict.fromkeys(TASKS, ratio)
        assert result[f"ratios_to_placo{suffix}_locked"] == dict.fromkeys(TASKS, round(ratio + 0.1, 4))
        assert result[f"p999_ratios_to_placo{suffix}"] == dict.fromkeys(TASKS, ratio)
    assert report.complete(result)
    assert report.short(result).rows[0][1:] == (
        "0.10 (1 / 10 us)", "0.20 (2 / 10 us)", "0.40 (4 / 10 us)",
    )  # fmt: skip


def test_the_tables_name_what_is_missed_and_nothing_else() -> None:
    result = measured({"best": 3.0, "readme": 3.0, "paced": 3.0})
    rows = {row[0]: row for row in report.missed(result).rows}
    assert set(rows) == {f"{TASKS[task]}, {way}" for task in TASKS for way in WAYS if GOALS[task][way] < 0.3}
    assert rows["Panda, velocity level, best"][2:] == ("0.30", "goal 0.25")
    assert rows["30 joints, velocity level, best"][2:] == ("0.30", "mark 0.22, goal 0.12")
    assert report.missed(measured({"best": 0.1, "readme": 0.1, "paced": 0.1})).rows[0][0] == "nothing"
