"""The table of the monitor: a row a hypothesis, and the page that explains it says the same."""

from pathlib import Path

import pytest

from ftqp.kernel.layout.hypotheses import HYPOTHESES, MONITOR, SERVO_TIMES, TORQUE_TIMES, Hypothesis

PAGE = Path(__file__).resolve().parents[3] / "docs" / "theory" / "feedback.md"


def test_every_hypothesis_has_one_row_in_the_order_of_its_number():
    assert [row.hypothesis for row in MONITOR] == list(Hypothesis)


def test_times_are_those_of_the_rows_and_above_zero():
    counted = MONITOR[:HYPOTHESES]
    assert tuple(row.torque for row in counted) == TORQUE_TIMES
    assert tuple(row.servo for row in counted) == SERVO_TIMES
    assert min(*TORQUE_TIMES, *SERVO_TIMES) > 0.0


def test_a_row_has_times_or_a_number_of_samples():
    assert all((row.samples > 0) != (min(row.torque, row.servo) > 0.0) for row in MONITOR)


@pytest.mark.parametrize("row", MONITOR, ids=lambda row: row.hypothesis.name)
def test_the_page_has_the_row_with_its_times_and_who_chose_them(row):
    name = row.hypothesis.name.lower().replace("_", " ")
    line = next(line for line in PAGE.read_text().splitlines() if line.startswith(f"| {name} |"))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    times = f"{1e3 * row.torque:g} ms" + (f", {1e3 * row.servo:g} ms" if row.servo != row.torque else "")
    assert cells[2] == (f"{row.samples} samples" if row.samples else times)
    assert cells[4] == row.chosen
