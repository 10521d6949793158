"""Laws of motion, and paths again and again, and backwards."""

import numpy as np
import pytest

import ftqp
from ftqp.control.paths import laws
from ftqp.control.paths.path import Backwards, Repeated, is_closed
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
        ({"name": "quintic", "ramp": 0.1}, "'ramp' is not a parameter of the law 'quintic'; it has none"),
        ({"name": "trapezoid", "rmp": 0.1}, "'rmp' is not a parameter of the law 'trapezoid'.*; it has ramp"),
        ({"name": "trapezoid", "ramp": 0.6}, r"ramp of the trapezoid law is 0.6, expected a fraction in"),
        ({"name": "trapezoid", "ramp": 0.0}, "ramp of the trapezoid law is 0, expected"),
        ({"ramp": 0.1}, "None is not a law of motion"),
        (3, "3 is not a law of motion"),
    ],
)
def test_wrong_law_is_one_clear_sentence(law, message):
    with pytest.raises(InputError, match=message):
        laws.by_name(law)


START = np.eye(4)
CIRCLE = ftqp.paths.Circle(START, 0.1, duration=4.0)
LINE = ftqp.paths.Line(START, (0.3, 0.0, 0.1), duration=2.0)


@pytest.mark.parametrize("path", [CIRCLE, LINE])
def test_first_lap_is_the_path_bit_by_bit(path):
    t = np.arange(0.0, path.duration, 0.01)
    one, other = path.sample(t), Repeated(path, 3).sample(t)
    for name in ("pose", "twist", "acceleration"):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name))


def test_closed_path_goes_round_and_an_open_one_there_and_back():
    assert is_closed(CIRCLE) and not is_closed(LINE)
    assert (Repeated(CIRCLE, 2).lap, Repeated(LINE, 2).lap) == (4.0, 4.0)
    np.testing.assert_allclose(Repeated(CIRCLE, 9).sample(9.3).pose, CIRCLE.sample(1.3).pose, atol=1e-12)
    there_and_back = Repeated(LINE, 9)
    np.testing.assert_allclose(there_and_back.sample(11.3).pose, LINE.sample(0.7).pose, atol=1e-12)
    np.testing.assert_allclose(there_and_back.sample(8.0).pose[0], START, atol=1e-12)


@pytest.mark.parametrize("path", [Repeated(CIRCLE, 3), Repeated(LINE, 3), Backwards(LINE)])
def test_twist_and_acceleration_are_derivatives_of_the_pose(path):
    h, t = 1e-5, np.linspace(0.11, path.duration - 0.11, 37)
    before, now, after = (path.sample(t + s) for s in (-h, 0.0, h))
    np.testing.assert_allclose((after.pose - before.pose)[:, :3, 3] / (2 * h), now.twist[:, :3], atol=1e-6)
    np.testing.assert_allclose((after.twist - before.twist) / (2 * h), now.acceleration, atol=1e-4)


def test_backwards_begins_where_the_path_ends():
    back = Backwards(LINE)
    np.testing.assert_array_equal(back.start, LINE.sample(2.0).pose[0])
    np.testing.assert_allclose(back.sample(2.0).pose[0], LINE.start, atol=1e-12)
