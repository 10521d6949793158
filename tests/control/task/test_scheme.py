"""Schemes are linear: they add up and scale, coefficient by coefficient, at both levels."""

from dataclasses import astuple, fields

import numpy as np
import pytest

from ftqp.control.task import schemes
from ftqp.control.task.scheme import Criterion, Scheme
from ftqp.core.errors import InputError

ONE = Criterion(**{f.name: float(i + 1) for i, f in enumerate(fields(Criterion))})


def test_criteria_add_up_coefficient_by_coefficient():
    np.testing.assert_array_equal(astuple(ONE + ONE), 2.0 * np.array(astuple(ONE)))


def test_criterion_scales_every_coefficient():
    np.testing.assert_array_equal(astuple(ONE.scaled(0.5)), 0.5 * np.array(astuple(ONE)))


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_mixed_scheme_is_the_weighted_sum_at_both_levels(level):
    mixed = 2.0 * schemes.mke() + schemes.rmp() * 3.0
    expected = 2.0 * np.array(astuple(schemes.mke().at(level))) + 3.0 * np.array(
        astuple(schemes.rmp().at(level))
    )
    np.testing.assert_allclose(astuple(mixed.at(level)), expected, rtol=1e-15)
    assert mixed.name == "2 mke + 3 rmp"


def test_negative_weight_is_refused():
    with pytest.raises(InputError, match="the weight of a scheme is -1, expected a finite number >= 0"):
        -1.0 * schemes.mvn()


def test_scheme_without_a_weight_is_refused_with_the_level():
    empty = Scheme(name="empty", acceleration=Criterion(norm=1.0), velocity=Criterion())
    assert empty.at("acceleration").norm == 1.0
    with pytest.raises(InputError, match="scheme 'empty' has no weight at the velocity level"):
        empty.at("velocity")


@pytest.mark.parametrize(
    ("criterion", "needs"),
    [
        (Criterion(norm=1.0), False),
        (Criterion(inertia=1.0), True),
        (Criterion(norm=1.0, torque=1e-9), True),
        (Criterion(norm=1.0, inertia_h=1.0), True),
    ],
)
def test_inertia_is_needed_exactly_when_a_term_has_it(criterion, needs):
    assert criterion.needs_inertia is needs


def test_hessian_is_constant_exactly_when_the_norm_alone_is_weighed():
    assert Criterion(norm=2.0, norm_v=1.0, inertia_h=1.0).has_constant_hessian
    assert not Criterion(norm=2.0, inertia=1.0).has_constant_hessian
    assert not Criterion(torque=1.0).has_constant_hessian
