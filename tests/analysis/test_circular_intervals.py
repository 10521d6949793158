"""Unions of intervals on the circle and on the line."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftqp.analysis.circular_intervals import TURN, CircularIntervals

ANGLE = st.floats(-10.0, 10.0)
PAIRS = st.lists(st.tuples(ANGLE, st.floats(0.0, 4.0)), max_size=5)


def union(pairs: list[tuple[float, float]]) -> CircularIntervals:
    return CircularIntervals.of([(low, low + width) for low, width in pairs])


def truly(pairs: list[tuple[float, float]], a: float, slack: float) -> bool:
    return any(low - slack <= a + k * TURN <= low + w + slack for low, w in pairs for k in range(-4, 5))


@given(PAIRS, ANGLE)
def test_value_belongs_to_the_union_if_it_belongs_to_one_of_the_intervals(
    pairs: list[tuple[float, float]], a: float
) -> None:
    found = union(pairs)
    if truly(pairs, a, -1e-6):
        assert found.contains(a)
    if not truly(pairs, a, 1e-6):
        assert not found.contains(a)
    assert (found.margin(a) >= 0.0) == found.contains(a)


@given(PAIRS)
def test_intervals_are_apart_and_begin_within_one_turn(pairs: list[tuple[float, float]]) -> None:
    found = union(pairs).intervals
    assert all(-np.pi <= low <= np.pi and low <= high <= low + TURN for low, high in found)
    assert all(a[1] < b[0] for a, b in pairwise(found))
    if len(found) > 1:
        assert found[-1][1] < found[0][0] + TURN


@given(PAIRS, PAIRS, ANGLE)
def test_union_and_intersection_are_those_of_sets(
    one: list[tuple[float, float]], two: list[tuple[float, float]], a: float
) -> None:
    A, B = union(one), union(two)
    if min(abs(A.margin(a)), abs(B.margin(a))) > 1e-6:
        assert (A | B).contains(a) == (A.contains(a) or B.contains(a))
        assert (A & B).contains(a) == (A.contains(a) and B.contains(a))


def test_margin_is_the_distance_to_the_nearest_end_across_the_seam() -> None:
    found = CircularIntervals.of([(3.0, 3.5)])
    assert found.margin(3.1) == pytest.approx(0.1)
    assert found.margin(3.4 - TURN) == pytest.approx(0.1)
    assert found.margin(np.array([2.0, 4.0])) == pytest.approx([-1.0, -0.5])
    assert 3.2 - TURN in found


def test_points_are_structural() -> None:
    assert CircularIntervals.of([(1.0, 1.0), (-1.0, -1.0)]).structural
    assert not CircularIntervals.of([(1.0, 1.1)]).structural
    assert not CircularIntervals.of([]).structural
