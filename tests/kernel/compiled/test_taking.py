from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ftqp.kernel.jit import BAD_BUFFER, take

ROOM = 12
Taken = Callable[..., tuple[int, list[float]]]


@pytest.fixture(scope="module", params=["plain", "built"])
def taken(request: pytest.FixtureRequest, ready: Any) -> Taken:
    """What take returns, and the numbers that it wrote; twice the room was there."""
    entry = ready.entry("taken", "oiiii")
    call = take if request.param == "plain" else ready.kernel().load(entry)

    def taken(source: Any, count: int = ROOM, first: int = 0, dimensions: int = 0) -> tuple[int, list[float]]:
        out = np.full(2 * ROOM, np.nan)
        found = int(call(source, first, out.ctypes.data, count, dimensions))
        written = out[~np.isnan(out)]
        assert np.isnan(out[len(written) :]).all()
        return found, written.tolist()

    return taken


@settings(deadline=None)  # the first call compiles
@given(st.lists(st.floats(allow_nan=False), max_size=2 * ROOM))
def test_numbers_are_copied_bit_by_bit_as_far_as_there_is_room(taken: Taken, numbers: list[float]) -> None:
    assert taken(np.array(numbers, dtype=float)) == (len(numbers), numbers[:ROOM])


def test_numbers_are_taken_from_the_first_one_asked_for(taken: Taken) -> None:
    A = np.arange(12.0).reshape(3, 4)
    for source in (A, memoryview(A)):
        assert taken(source, 4, first=4) == (8, [4.0, 5.0, 6.0, 7.0])
        assert taken(source, 4, first=10) == (2, [10.0, 11.0])
        assert taken(source, 4, first=12) == taken(source, 4, first=99) == (0, [])


def test_another_number_of_dimensions_is_refused(taken: Taken) -> None:
    A = np.arange(16.0)
    for source in (A, A.reshape(4, 4), memoryview(A), memoryview(A.reshape(4, 4))):
        assert taken(source, dimensions=np.ndim(source))[0] == 16
        assert taken(source, dimensions=3 - np.ndim(source)) == (BAD_BUFFER, [])


def test_what_is_no_contiguous_float64_is_refused(taken: Taken) -> None:
    A = np.arange(12.0).reshape(3, 4)
    for source in (
        A.T,
        A[:, 1],
        A.ravel()[::2],
        A.ravel()[::-1],
        A.astype(">f8"),
        A.astype(np.float32),
        A.astype(np.int64),
        A.astype(np.complex128),
        A.astype(object),
        A.view([("x", float), ("y", float)]),
        np.array(3.0),
        np.float64(3.0),
        np.array(["2020-01-01"], dtype="M8[s]"),
        [1.0, 2.0],
        (1.0,),
        3.0,
        7,
        None,
        "12345678",
        b"12345678",
        object(),
        memoryview(A)[::2],
    ):
        assert taken(source) == (BAD_BUFFER, [])
