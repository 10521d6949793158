"""Examples of several tasks, as pink and placo have them: ftqp ends where it is asked, and they are short."""

import pytest
from compare_tasks import EXAMPLES, errors, lines, posed
from posed import with_ftqp


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_task_of_an_example_is_kept_and_no_peer_needs_fewer_lines(example):
    robot, q, goals = posed(example)
    end = getattr(with_ftqp, example)(robot, q, goals, 1500)
    assert errors(example, robot, q, end, goals) < 1e-3 < errors(example, robot, q, q, goals)
    assert all(lines("ftqp", example) <= (lines(peer, example) or 99) for peer in ("pink", "placo"))
