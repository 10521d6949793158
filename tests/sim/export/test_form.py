import numpy as np
import pytest

from ftqp.core.errors import FtqpError
from ftqp.sim.export.form import MOST, Form


def test_marks_are_in_no_text_and_differ():
    form = Form()
    marks = [
        *(form.reals(200, None)[:, None].view(np.uint8).reshape(200, 8)),
        *(form.wholes(200, None)[:, None].view(np.uint8).reshape(200, 4)),
    ]
    assert len({mark.tobytes() for mark in marks}) == 400
    assert all(0xFF in mark for mark in marks)  # no byte of UTF-8


def test_number_that_was_not_serialised_is_noticed():
    class Two:
        block = np.empty((2, 0))

    form = Form()
    mark = form.reals(1, lambda ticks: np.array([[1.0], [2.0]])).tobytes()
    np.testing.assert_array_equal(form.filled(b"ab" + mark, Two())[:, 2:].copy().view(float), [[1.0], [2.0]])
    for data in (b"ab", mark + mark):
        with pytest.raises(FtqpError, match="not serialised"):
            form.filled(data, Two())


def test_message_has_at_most_so_many_numbers():
    with pytest.raises(FtqpError, match="more than"):
        Form().reals(MOST + 1, None)
