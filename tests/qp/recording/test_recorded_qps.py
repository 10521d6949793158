"""A recording is checked as a whole and says which ticks it has."""

from dataclasses import replace

import numpy as np
import pytest
from recorded import small

from ftqp.core.errors import InputError


def test_an_unknown_tick_is_answered_with_the_range_and_the_nearest():
    recording = small()
    sparse = replace(recording, tick=np.array([10, 12, 15, 20, 31]))
    with pytest.raises(InputError, match=r"tick 9 was not recorded, expected one of 0 to 4; .* is 4"):
        recording.position(9)
    with pytest.raises(InputError, match=r"one of 10 to 31 \(5 of them\); the nearest recorded one is 15"):
        sparse.position(16)
    with pytest.raises(InputError, match="nearest recorded one is 10"):
        sparse.position(-3)


def changed(name, change):
    value = np.array(getattr(small(), name))
    return {name: change(value)}


WRONG = {
    "too few rows": (changed("A", lambda a: a[:, :0]), r"A has shape \(5, 0, 3\), expected \(K, m, n\)"),
    "another K": (changed("x", lambda x: x[:-1]), r"x has shape \(4, 3\), expected \(K, n\) = \(5, 3\)"),
    "flat g": (changed("g", lambda g: g.ravel()), "has shape"),
    "no QP": (changed("g", lambda g: g[:0]), "has shape"),
    "text": ({"b": np.array([["one"]] * 5)}, "b is no array of numbers"),
    "ticks": (changed("tick", lambda t: t[::-1]), "tick does not rise"),
    "few names": ({"variables": ("a", "b")}, "variables has 2 different names, expected 3"),
    "same names": ({"rows": ("a", "b", "b")}, "rows has 2 different names, expected 3"),
}


@pytest.mark.parametrize(("parts", "message"), WRONG.values(), ids=WRONG)
def test_parts_that_do_not_fit_are_refused(parts, message):
    with pytest.raises(InputError, match=message):
        replace(small(), **parts)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("g", lambda g: g * np.nan, "g"),
        ("l", lambda l: l + 10.0, "leave nothing between them"),
        ("H", lambda h: h + np.triu(np.ones((3, 3)), 1), "H is not symmetric"),
    ],
)
def test_a_qp_that_is_none_is_refused_when_it_is_asked_for(name, change, message):
    with pytest.raises(InputError, match=message):
        replace(small(), **changed(name, change)).problem(0)
