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
    "flat g": (changed("g", lambda g: g.ravel()), r"g has shape \(15,\), expected one row a QP"),
    "no QP": (changed("g", lambda g: g[:0]), r"g has shape \(0, 3\), expected at least one QP"),
    "NaN in g": (
        changed("g", lambda g: np.where(np.arange(5)[:, None] == 2, np.nan, g)),
        "g is not finite in QP 2",
    ),
    "NaN in ub": (changed("ub", lambda u: u * np.nan), "lb and ub leave nothing between them in QP 0"),
    "crossed": (changed("l", lambda l: l + 10.0), "l and u leave nothing between them in QP 0"),
    "skew H": (changed("H", lambda h: h + np.triu(np.ones((3, 3)), 1)), "H is not symmetric in QP 0"),
    "claim": (changed("claim", lambda c: c + 7), "claim is 7, expected 0 to 4"),
    "float claim": (changed("claim", lambda c: c + 0.5), "claim holds float64, expected whole numbers"),
    "cold": (changed("cold", lambda c: c.astype(int)), "cold holds int64, expected true or false"),
    "text": ({"b": np.array([["one"]] * 5)}, "b holds str96, expected numbers"),
    "NaN solved": (changed("z", lambda z: z * np.nan), "z is not finite in QP 0, which counts as solved"),
    "ticks": (changed("tick", lambda t: t[::-1]), "tick does not rise after QP 0"),
    "few names": ({"variables": ("a", "b")}, "variables has 2 different names, expected 3"),
    "same names": ({"rows": ("a", "b", "b")}, "rows has 2 different names, expected 3"),
    "no names": ({"rows": (1, 2, 3)}, "expected 3 names"),
}


@pytest.mark.parametrize(("parts", "message"), WRONG.values(), ids=WRONG)
def test_parts_that_do_not_fit_are_refused(parts, message):
    with pytest.raises(InputError, match=message):
        replace(small(), **parts)
