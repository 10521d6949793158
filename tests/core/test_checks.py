"""Checks of arrays and numbers refuse with one sentence and hand back fresh float64; errors and clocks."""

import numpy as np
import pytest

from ftqp.core.checks import array, is_number, non_negative, positive
from ftqp.core.errors import (
    FtqpError,
    InputError,
    MissingPackage,
    ModelError,
    ScenarioError,
    nearest,
    unknown,
)


@pytest.mark.parametrize("value", [[1, 2, 3], (1.0, 2.0, 3.0), np.array([1, 2, 3], dtype=np.float32)])
def test_numbers_of_any_kind_become_contiguous_float64(value):
    result = array("v", value, (3,))
    assert result.dtype == np.float64 and result.flags["C_CONTIGUOUS"] and result.flags["WRITEABLE"]
    np.testing.assert_array_equal(result, [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (np.zeros(6), "v has shape (6,), expected (nv,) = (7,)"),
        (0.0, "v has shape (), expected (nv,) = (7,)"),
        ("fast", "v is not an array of numbers: 'fast'; expected shape (7,)"),
        ([[1.0], [1.0, 2.0]], "v is not an array of numbers: [[1.0], [1.0, 2.0]]; expected shape (7,)"),
        ([0, 0, np.nan, 0, 0, 0, 0], "v contains NaN at index 2; expected numbers"),
        ([0, 0, 0, 0, -np.inf, 0, 0], "v is infinite at index 4; expected finite numbers"),
    ],
)
def test_wrong_array_is_refused_with_one_sentence(value, sentence):
    with pytest.raises(InputError) as error:
        array("v", value, (7,), "(nv,)")
    assert str(error.value) == sentence


def test_infinity_passes_where_it_means_no_limit_but_nan_never():
    assert np.isinf(array("ub", [np.inf], (1,), finite=False)).all()
    with pytest.raises(InputError, match="NaN"):
        array("ub", [np.nan], (1,), finite=False)


@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan])
def test_number_that_is_not_positive_and_finite_is_refused(value):
    with pytest.raises(InputError, match=r"dt is \S+, expected a finite number > 0 s"):
        positive("dt", value, "s")


@pytest.mark.parametrize("value", [None, "soon", "2", "1_000", b"1", [1.0, 2.0], np.ones(1), 1j, 10**400])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(InputError, match=r"dt is .*, expected a number in s"):
        positive("dt", value, "s")


def test_zero_is_not_negative_but_minus_one_is():
    assert non_negative("gain", 0) == 0.0
    with pytest.raises(InputError, match=r"gain is -1, expected a finite number >= 0"):
        non_negative("gain", -1)


@pytest.mark.parametrize(
    "value",
    [True, None, "1", [1.0], np.float32(1.0), 1j, float("nan"), float("inf"), -float("inf"), 10**400, 1e301],
)
def test_what_cannot_be_computed_with_is_no_number(value):
    assert not is_number(value)


@pytest.mark.parametrize("kind", [InputError, ModelError, ScenarioError, MissingPackage])
def test_every_exception_descends_from_the_root(kind):
    assert issubclass(kind, FtqpError)


def test_missing_package_is_also_an_import_error():
    error = MissingPackage("backend 'osqp'", "osqp", "pip install osqp")
    assert isinstance(error, ImportError)
    assert (error.package, error.remedy) == ("osqp", "pip install osqp")
    assert str(error) == "backend 'osqp' needs the package 'osqp', which is not installed; pip install osqp"


def test_close_name_is_suggested_and_a_distant_one_is_not():
    assert nearest("quadrpog", ("daqp", "quadprog")) == " (did you mean 'quadprog'?)"
    assert nearest("zzzz", ("daqp", "quadprog")) == ""


def test_unknown_name_is_told_the_valid_ones_and_the_nearest():
    error = unknown("joint", "elbowe", "planar_3r", iter(["shoulder", "elbow"]))
    assert isinstance(error, InputError)
    assert (
        str(error) == "'elbowe' is not a joint of planar_3r (did you mean 'elbow'?); it has shoulder, elbow"
    )
