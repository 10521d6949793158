from dataclasses import dataclass

import pytest

from ftqp import InputError
from ftqp.qp.adapters.backend_settings import settings


@dataclass(frozen=True, kw_only=True)
class Some:
    tolerance: float = 1e-9
    shift: float = 0.0
    cap: int = 10
    verbose: bool = False


def test_given_values_replace_defaults():
    assert settings(Some, "some", {"tolerance": 1e-3, "cap": 2, "verbose": True, "shift": 0}) == Some(
        tolerance=1e-3, cap=2, verbose=True, shift=0.0
    )


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"tolerence": 1.0}, "'tolerence' is not a setting of backend 'some' (did you mean 'tolerance'?)"),
        ({"tolerance": 0.0}, "some.tolerance is 0, expected a finite number > 0"),
        ({"tolerance": float("nan")}, "some.tolerance is nan"),
        ({"tolerance": "1e-9"}, "some.tolerance is '1e-9', expected a number"),
        ({"tolerance": None}, "some.tolerance is None, expected a number"),
        ({"shift": -1.0}, "some.shift is -1, expected a finite number >= 0"),
        ({"cap": 0}, "some.cap is 0, expected a whole number from 1 to"),
        ({"cap": 2.5}, "some.cap is 2.5, expected a whole number from 1 to"),
        ({"cap": True}, "some.cap is True, expected a number"),
        ({"verbose": 1}, "some.verbose is 1, expected true or false"),
    ],
)
def test_a_wrong_setting_is_refused_in_one_sentence(given, sentence):
    with pytest.raises(InputError) as error:
        settings(Some, "some", given)
    assert sentence in str(error.value)


@pytest.mark.parametrize(("name", "remedy"), [("proxqp", "max_iterations"), ("active_set", "leave it out")])
def test_a_solver_without_a_clock_says_how_its_time_is_bounded(name, remedy):
    from ftqp.qp import backend

    with pytest.raises(InputError, match=f"backend '{name}' has no time_limit.*{remedy}"):
        backend({"name": name, "time_limit": 1e-3})
