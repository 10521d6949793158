"""Bound conversions are found by name and refuse senseless parameters."""

import dataclasses

import numpy as np
import pytest

from ftqp.control.task import bounds
from ftqp.control.task.bounds import Jin, OneStep, Viability
from ftqp.core.errors import InputError
from ftqp.kernel.layout import enums as codes


def test_every_conversion_is_known_by_name_by_its_table_and_as_itself():
    assert bounds.names() == ("viability", "jin", "one_step")
    for name, kind, code in zip(
        bounds.names(), (Viability, Jin, OneStep), (codes.VIABILITY, codes.JIN, codes.ONE_STEP), strict=True
    ):
        assert bounds.by_name(name) == kind() and kind.code == code
    assert bounds.by_name({"name": "jin", "gamma_p": 5.0, "margin": 0.0}) == Jin(gamma_p=5.0, margin=0.0)
    mine = Jin(gamma_v=3.0)
    assert bounds.by_name(mine) is mine


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            "viable",
            r"'viable' is not a bound conversion \(did you mean 'viability'\?\); there are viability, jin, ",
        ),
        ("", "'' is not a bound conversion; there are viability, jin, one_step"),
        ({"gamma_p": 1.0}, "None is not a bound conversion"),
        (
            {"name": "jin", "gama_p": 1.0},
            r"'gama_p' is not a parameter of bounds 'jin' \(did you mean 'gamma_p'\?\)",
        ),
        (
            {"name": "viability", "margin": 0.1},
            "'margin' is not a parameter of bounds 'viability'; it has none",
        ),
        ({"name": "jin", "gamma_p": 0.0}, "gamma_p is 0, expected a finite number > 0"),
        ({"name": "jin", "upsilon": np.inf}, "upsilon is inf, expected a finite number > 0"),
        ({"name": "jin", "margin": -0.1}, "margin is -0.1, expected a finite number >= 0 rad"),
    ],
)
def test_wrong_conversion_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        bounds.by_name(given)


def test_conversions_are_those_that_their_docstrings_describe_and_cannot_be_changed():
    jin = Jin()
    assert (jin.gamma_p, jin.gamma_v, jin.margin, jin.upsilon) == (20.0, 20.0, 0.1, 4.0)
    for conversion, key in ((jin, "margin"), (Viability(), "anything"), (OneStep(), "anything")):
        with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
            setattr(conversion, key, 1.0)
    assert len({Jin(), Jin(), Viability(), OneStep()}) == 3, "equal ones are one"
