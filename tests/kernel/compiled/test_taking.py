from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ftqp.kernel.compiled.taking import BAD_BUFFER, take

ROOM = 12
Taken = Callable[..., tuple[int, list[float]]]


class Subclass(np.ndarray):  # type: ignore[type-arg]
    pass


@pytest.fixture(scope="module", params=["plain", "built"])
def taken(request: pytest.FixtureRequest, ready: Any) -> Taken:
    """What take returns, and the numbers that it wrote; twice the room was there."""
    entry = ready.entry("taken", "oiiii")
    call = take if request.param == "plain" else ready.kernel().load(entry, 0)

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


def test_every_c_contiguous_shape_is_taken_row_by_row(taken: Taken) -> None:
    A = np.arange(12.0).reshape(3, 4)
    for source in (A, A.reshape(2, 3, 2), A[1:], A[:0], np.zeros((0, 3)), np.zeros((3, 0))):
        assert taken(source) == (source.size, source.ravel().tolist())


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


@pytest.mark.parametrize("shape", [(2, 8), (8, 2), (1, 16), (16, 1)])
def test_two_dimensions_are_those_of_a_square_matrix(taken: Taken, shape: tuple[int, int]) -> None:
    A = np.arange(16.0).reshape(shape)
    for source in (A, memoryview(A)):
        assert taken(source, dimensions=2) == (BAD_BUFFER, [])
        assert taken(source)[0] == 16


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


def test_refusal_leaves_no_python_error(taken: Taken) -> None:
    assert taken([1.0])[0] == BAD_BUFFER
    assert list(range(3)) == [0, 1, 2]
    int("12")


def test_everything_that_offers_a_buffer_of_float64_is_taken(taken: Taken, tmp_path: Path) -> None:
    import array
    import ctypes

    numbers = np.arange(1.0, 6.0)
    numbers.tofile(tmp_path / "numbers")
    mapped = np.memmap(tmp_path / "numbers", dtype=float, mode="r")
    for source in (
        numbers,
        numbers.view(Subclass),
        mapped,
        memoryview(numbers),
        array.array("d", numbers),
        (ctypes.c_double * 5)(*numbers),
        numbers.astype("<f8"),
        numbers.astype(np.dtype("=f8").newbyteorder("=")),
    ):
        assert taken(source) == (5, numbers.tolist())


def test_read_only_and_unaligned_arrays_are_taken(taken: Taken) -> None:
    numbers = np.arange(1.0, 6.0)
    frozen = numbers.copy()
    frozen.flags.writeable = False
    shifted = np.frombuffer(b"x" + numbers.tobytes(), dtype=float, offset=1)
    assert not shifted.flags.aligned
    for source in (frozen, shifted):
        assert taken(source) == (5, numbers.tolist())


def test_array_that_changes_between_calls_is_read_as_it_is_then(taken: Taken) -> None:
    source = np.arange(1.0, 4.0)
    assert taken(source) == (3, [1.0, 2.0, 3.0])
    source.resize(6, refcheck=False)
    assert taken(source) == (6, [1.0, 2.0, 3.0, 0.0, 0.0, 0.0])
    source.resize(0, refcheck=False)
    assert taken(source) == (0, [])
    retyped = np.arange(4, dtype=np.int64)
    assert taken(retyped)[0] == BAD_BUFFER
    retyped = retyped.view(float)
    assert taken(retyped)[0] == 4


def test_released_view_is_refused(taken: Taken) -> None:
    view = memoryview(np.arange(3.0))
    view.release()
    assert taken(view) == (BAD_BUFFER, [])


@pytest.mark.parametrize("count", [0, 1, 5])
def test_no_more_than_asked_for_is_written(taken: Taken, count: int) -> None:
    numbers = np.arange(1.0, 6.0)
    for source in (numbers, memoryview(numbers)):
        assert taken(source, count) == (5, numbers[:count].tolist())
