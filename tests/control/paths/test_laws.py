import numpy as np
import pytest

from ftqp.control.paths import laws
from ftqp.core.errors import InputError

ALL = [*laws.names(), {"name": "trapezoid", "ramp": 0.5}, {"name": "trapezoid", "ramp": 0.03}]


@pytest.mark.parametrize("law", ALL, ids=str)
def test_law_goes_from_zero_to_one_without_turning_back(law):
    u = np.linspace(0.0, 1.0, 501)
    s, ds, _ = laws.by_name(law).sample(u)
    assert s[0] == 0.0
    assert s[-1] == 1.0
    assert (np.diff(s) > 0.0).all()
    assert (ds >= 0.0).all()


@pytest.mark.parametrize("law", ALL, ids=str)
def test_derivatives_are_those_of_s(law):
    u = np.linspace(0.0123, 0.9871, 40)
    step = 1e-5
    law = laws.by_name(law)
    before, here, after = law.sample(u - step), law.sample(u), law.sample(u + step)
    np.testing.assert_allclose(here.ds, (after.s - before.s) / (2 * step), atol=1e-8)
    np.testing.assert_allclose(here.dds, (after.ds - before.ds) / (2 * step), atol=1e-7)


@pytest.mark.parametrize("law", ALL, ids=str)
def test_law_rests_outside_its_time(law):
    sample = laws.by_name(law).sample(np.array([-1.0, 1.0, 2.0]))
    np.testing.assert_array_equal(sample.s, [0.0, 1.0, 1.0])
    np.testing.assert_array_equal(sample.ds, 0.0)
    np.testing.assert_array_equal(sample.dds, 0.0)


def test_trapezoid_tops_out_at_its_cruise_speed():
    ds = laws.Trapezoid(ramp=0.2).sample(np.linspace(0.0, 0.999, 1000)).ds
    assert ds.max() == pytest.approx(1.0 / 0.8)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("quintc", r"'quintc' is not a law of motion of ftqp \(did you mean 'quintic'\?\); it has quintic"),
        ({"name": "quintic", "ramp": 0.1}, "'ramp' is not a parameter of the law 'quintic'; it takes no"),
        ({"name": "trapezoid", "rmp": 0.1}, "'rmp' is not a parameter of the law 'trapezoid'; it takes ramp"),
        ({"name": "trapezoid", "ramp": 0.6}, r"ramp of the trapezoid law is 0.6, expected a fraction in"),
        ({"name": "trapezoid", "ramp": 0.0}, "ramp of the trapezoid law is 0, expected"),
        ({"ramp": 0.1}, "None is not a law of motion"),
        (3, "3 is not a law of motion"),
    ],
)
def test_wrong_law_is_one_clear_sentence(law, message):
    with pytest.raises(InputError, match=message):
        laws.by_name(law)
