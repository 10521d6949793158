"""The exceptions carry their facts and say one sentence."""

import pytest

from ftqp.core.errors import (
    FtqpError,
    InputError,
    MissingPackage,
    ModelError,
    ScenarioError,
    nearest,
    unknown,
)


@pytest.mark.parametrize("kind", [InputError, ModelError, ScenarioError, MissingPackage])
def test_every_exception_descends_from_the_root(kind):
    assert issubclass(kind, FtqpError)


def test_missing_package_is_also_an_import_error():
    error = MissingPackage("backend 'osqp'", "osqp", "pip install osqp")
    assert isinstance(error, ImportError)
    assert (error.package, error.remedy) == ("osqp", "pip install osqp")
    assert str(error) == "backend 'osqp' needs the package 'osqp', which is not installed; pip install osqp"


@pytest.mark.parametrize(("kind", "field"), [(ModelError, "findings"), (ScenarioError, "errors")])
def test_error_of_many_findings_lists_each_on_a_line_of_its_own(kind, field):
    error = kind("arm is unsafe", ["j1 has no limit", "j2 has no mass"])
    assert getattr(error, field) == ("j1 has no limit", "j2 has no mass")
    assert str(error).splitlines() == ["arm is unsafe", "  - j1 has no limit", "  - j2 has no mass"]


def test_close_name_is_suggested_and_a_distant_one_is_not():
    assert nearest("quadrpog", ("daqp", "quadprog")) == " (did you mean 'quadprog'?)"
    assert nearest("zzzz", ("daqp", "quadprog")) == ""


def test_unknown_name_is_told_the_valid_ones_and_the_nearest():
    error = unknown("joint", "elbowe", "planar_3r", iter(["shoulder", "elbow"]))
    assert isinstance(error, InputError)
    assert (
        str(error) == "'elbowe' is not a joint of planar_3r (did you mean 'elbow'?); it has shoulder, elbow"
    )
