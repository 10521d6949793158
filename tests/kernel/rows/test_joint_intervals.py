"""Joint limits as intervals: published values, and what random play inside them can break."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from records import believe, empty_record

from ftqp.kernel.jit import COMPILED
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.rows import joint_intervals as bounds

DTS = (0.001, 0.01, 0.05)
EXACT = settings(max_examples=60, deadline=None, derandomize=True)
LONG = pytest.mark.skipif(not COMPILED, reason="long runs of compiled helpers: test_jit")
PLANAR6 = {"q_min": 0.009, "q_max": 0.445, "v_max": 0.4, "a_max": 2.0}
"""Limits of joint 6 of the planar arm."""


def joints(limits, dt, level=codes.ACCELERATION, conversion=codes.VIABILITY):
    """One record of 64 joints with those limits, each a number or (64,)."""
    K = empty_record(JOINTS)
    K.chain.n, K.state.dt, K.state.level, K.limits.conversion = JOINTS, dt, level, conversion
    for name, value in limits.items():
        getattr(K.limits, name)[:] = value
    room = K.limits
    room.a_brake[:] = limits.get("a_brake", limits["a_max"])
    room.jin_p, room.jin_v, room.jin_margin, room.jin_upsilon = 20.0, 20.0, 0.1, 4.0
    believe(K)
    return K


def interval(K, q, v):
    """lb and ub, (64,), at (q, v)."""
    K.state.q[:], K.state.v[:] = q, v
    bounds.intervals(K)
    return K.qp.lb[:JOINTS], K.qp.ub[:JOINTS]


def random_limits(rng, dt):
    """Limits whose range is wide beside one step, as every arm's is."""
    a_max = rng.uniform(0.5, 20.0, JOINTS)
    v_max = rng.uniform(2.0, 60.0, JOINTS) * a_max * dt
    width = rng.uniform(20.0, 2000.0, JOINTS) * a_max * dt * dt
    q_min = rng.uniform(-3.0, 3.0, JOINTS)
    return {"q_min": q_min, "q_max": q_min + width, "v_max": v_max, "a_max": a_max}


def choice(rng, style, lb, ub):
    """A value inside the interval: anywhere, at either end, or pushing one way for a while."""
    if style == "random":
        return rng.uniform(lb, ub)
    if style == "bang-bang":
        return np.where(rng.random(JOINTS) < 0.5, lb, ub)
    return ub if style == "up" else lb


STYLES = ("random", "bang-bang", "up", "down")


@pytest.mark.parametrize(("d", "expected"), [(1e-4, 0.01), (1e-3, 0.0533333), (1e-2, 0.19), (1e-1, 0.6225)])
def test_braking_velocity_has_the_published_check_values(d, expected):
    assert abs(bounds.braking_velocity(d, 2.0, 0.01) - expected) < 5e-8


def test_viability_has_its_check_values():
    K = joints(PLANAR6, 0.01)
    lb, ub = interval(K, 0.444, 0.05)
    assert lb[0] == -2.0 and abs(ub[0] + 0.5) < 1e-11, "from 0.045 rad/s three steps stop it, -0.5, -2, -2"
    lb, ub = interval(K, 0.44, 0.1)
    assert lb[0] == -2.0 and ub[0] == 2.0


@pytest.mark.parametrize("level", [codes.ACCELERATION, codes.VELOCITY])
@pytest.mark.parametrize("beyond", [0.0, 1e-16, 5e-13])
@pytest.mark.parametrize("v", [0.0, 1e-14, 5e-9])
def test_rounding_at_a_position_limit_asks_for_no_jolt(level, beyond, v):
    K = joints({"q_min": -1.0, "q_max": 0.0, "v_max": 2.0, "a_max": 10.0}, 0.002, level)
    lb, ub = interval(K, beyond, v)
    assert np.all(lb <= ub)
    assert abs(ub[0]) < 1e-4, "the joint stands; before, it left its limit at a_max"
    assert abs(interval(K, -1.0 - beyond, -v)[0][0]) < 1e-4


@LONG
@pytest.mark.parametrize("level", [codes.ACCELERATION, codes.VELOCITY])
@pytest.mark.parametrize("dt", DTS)
@pytest.mark.parametrize("share", [0.2, 1.0])
def test_a_joint_that_is_pressed_against_its_limit_comes_to_rest_there(level, dt, share):
    """The limit itself does not throw it back: before, it went to and fro at full acceleration for ever."""
    rng = np.random.default_rng(3)
    limits = random_limits(rng, dt)
    a_max, a_brake = limits["a_max"], share * limits["a_max"]
    K = joints({**limits, "a_brake": a_brake}, dt, level)
    q, v = rng.uniform(limits["q_min"], limits["q_max"]), np.zeros(JOINTS)
    turns, last = np.zeros(JOINTS), np.zeros(JOINTS)
    for _ in range(4000):
        _, ub = interval(K, q, v)
        a = np.array(ub) if level == codes.ACCELERATION else (ub - v) / dt
        assert np.all(a >= -a_brake * (1.0 + 1e-6)), "no more than braking counts on"
        full = np.where(np.abs(a) >= 0.5 * a_max, np.sign(a), 0.0)
        turns += (full * last) < 0.0
        last = np.where(full != 0.0, full, last)
        q, v = q + dt * v + 0.5 * dt * dt * a if level == codes.ACCELERATION else q + dt * ub, v + dt * a
        if np.all(np.abs(limits["q_max"] - q) < 1e-11) and np.all(np.abs(v) < 1e-9):
            break
    assert np.all(turns <= 1), "it speeds up and brakes"
    assert np.allclose(q, limits["q_max"], rtol=0.0, atol=1e-11) and np.all(np.abs(v) < 1e-9)


def test_jin_has_the_published_check_value_and_its_formula():
    K = joints(PLANAR6, 0.01, conversion=codes.JIN)
    lb, ub = interval(K, 0.40, 0.1)
    assert lb[0] == -2.0 and abs(ub[0] + 1.1) < 1e-12
    q, v = np.linspace(0.109, 0.345, JOINTS), np.linspace(-0.39, 0.39, JOINTS)
    lb, ub = interval(K, q, v)
    assert np.allclose(
        ub, np.minimum.reduce([20 * (0.345 - q), 20 * (0.4 - v), np.full(JOINTS, 2.0)]), atol=1e-13
    )
    assert np.allclose(
        lb, np.maximum.reduce([20 * (0.109 - q), 20 * (-0.4 - v), np.full(JOINTS, -2.0)]), atol=1e-13
    )


def test_jin_at_the_velocity_level_has_its_formula():
    K = joints(PLANAR6, 0.01, codes.VELOCITY, codes.JIN)
    q = np.linspace(0.009, 0.445, JOINTS)
    lb, ub = interval(K, q, 0.0)
    assert np.allclose(ub, np.minimum(0.4, 4.0 * (0.445 - q)), atol=1e-14)
    assert np.allclose(lb, np.maximum(-0.4, -4.0 * (q - 0.009)), atol=1e-14)


def test_one_step_has_its_formula():
    K = joints(PLANAR6, 0.01, conversion=codes.ONE_STEP)
    q = np.linspace(0.2, 0.44, JOINTS)
    _, ub = interval(K, q, 0.1)
    expected = np.minimum.reduce([2e4 * (0.445 - q - 1e-3), np.full(JOINTS, 30.0), np.full(JOINTS, 2.0)])
    assert np.allclose(ub, expected, atol=1e-10)


PLAY = given(
    seed=st.integers(0, 2**32),
    dt=st.sampled_from(DTS),
    style=st.sampled_from(STYLES),
    share=st.floats(0.1, 1.0),
)


@LONG
@PLAY
@EXACT
def test_viability_is_never_empty_and_never_broken(seed, dt, style, share):
    rng = np.random.default_rng(seed)
    limits = random_limits(rng, dt)
    limits["a_brake"] = share * limits["a_max"]
    K = joints(limits, dt)
    low, high, v_max, a_max, a_brake = (limits[k] for k in ("q_min", "q_max", "v_max", "a_max", "a_brake"))
    q = rng.uniform(low, high)
    v = rng.uniform(
        -np.minimum(v_max, np.sqrt(2.0 * a_brake * (q - low))),
        np.minimum(v_max, np.sqrt(2.0 * a_brake * (high - q))),
    )
    for _ in range(300):
        lb, ub = interval(K, q, v)
        assert np.all(lb <= ub) and np.all(lb >= -a_max) and np.all(ub <= a_max)
        a = choice(rng, style, lb, ub)
        with np.errstate(divide="ignore", invalid="ignore"):
            turning = np.where((v != 0.0) & (v * (v + a * dt) < 0.0), q - v * v / (2.0 * a), q)
        q, v = q + dt * v + 0.5 * dt * dt * a, v + dt * a
        for position in (q, turning):
            assert np.all(position <= high + 1e-9) and np.all(position >= low - 1e-9)
        assert np.all(np.abs(v) <= v_max + 1e-9)
    assert K.limits.empty_intervals == 0


@LONG
@PLAY
@EXACT
def test_discrete_braking_is_never_empty_and_never_broken(seed, dt, style, share):
    rng = np.random.default_rng(seed)
    limits = random_limits(rng, dt)
    limits["a_brake"] = share * limits["a_max"]
    K = joints(limits, dt, codes.VELOCITY)
    q, v = rng.uniform(limits["q_min"], limits["q_max"]), np.zeros(JOINTS)
    for _ in range(300):
        lb, ub = interval(K, q, v)
        assert np.all(lb <= ub)
        x = choice(rng, style, lb, ub)
        assert np.all(np.abs(x - v) <= limits["a_max"] * dt + 1e-9)
        assert np.all(np.abs(x) <= limits["v_max"] + 1e-9)
        q, v = q + dt * x, x
        assert np.all(q <= limits["q_max"] + 1e-9) and np.all(q >= limits["q_min"] - 1e-9)
    assert K.limits.empty_intervals == 0


def overrun(conversion, dt, ticks=4000):
    """Largest overrun of position and of velocity by bang-bang play from viable starts."""
    rng = np.random.default_rng(9)
    limits = {**PLANAR6, "q_min": -0.2, "q_max": 0.245}
    K = joints(limits, dt, conversion=conversion)
    q, v = np.zeros(JOINTS), np.zeros(JOINTS)
    worst = np.zeros(2)
    push = rng.random(JOINTS) < 0.5
    for k in range(ticks):
        if k % 150 == 0:  # a new viable start
            q = rng.uniform(limits["q_min"], limits["q_max"], JOINTS)
            stop = np.sqrt(4.0 * np.array([q - limits["q_min"], limits["q_max"] - q]))
            v = rng.uniform(-np.minimum(0.4, stop[0]), np.minimum(0.4, stop[1]))
        push = np.where(rng.random(JOINTS) < 0.03, ~push, push)
        lb, ub = interval(K, q, v)
        a = np.where(push, ub, lb)
        q, v = q + dt * v + 0.5 * dt * dt * a, v + dt * a
        worst = np.maximum(
            worst, [np.maximum(limits["q_min"] - q, q - limits["q_max"]).max(), np.abs(v).max() - 0.4]
        )
    return worst


@LONG
def test_one_step_overruns_positions_by_the_braking_distance():
    """0.040 rad = v^2 / 2A, as published; never more."""
    position, velocity = overrun(codes.ONE_STEP, 0.01)
    assert 0.038 < position < 0.0425
    assert velocity < 1e-9


@LONG
def test_jin_overruns_positions_from_viable_starts_and_viability_does_not():
    """Published: up to 0.009 rad from arbitrary viable starts; here within a factor of two of that."""
    position, _ = overrun(codes.JIN, 0.01)
    assert 0.0045 < position < 0.018
    assert np.all(overrun(codes.VIABILITY, 0.01) < 1e-9)


@LONG
@pytest.mark.parametrize("level", [codes.ACCELERATION, codes.VELOCITY])
@pytest.mark.parametrize("dt", DTS)
def test_a_joint_outside_its_limits_is_led_back_with_bounded_acceleration(level, dt):
    limits = {"q_min": -1.0, "q_max": 1.0, "v_max": 1.0, "a_max": 5.0}
    K = joints(limits, dt, level)
    q = np.where(np.arange(JOINTS) % 2, -1.0, 1.0) * (1.0 + np.geomspace(1e-6, 0.8, JOINTS))
    v = 0.5 * np.sign(q) * np.linspace(1.0, -1.0, JOINTS)
    back = np.full(JOINTS, False)
    outward = np.sign(q)
    for _ in range(round(6.0 / dt)):
        lb, ub = interval(K, q, v)
        assert np.all(lb <= ub)
        x = np.where(outward > 0.0, ub, lb)  # the objective wants to stay out
        a = x if level == codes.ACCELERATION else (x - v) / dt
        assert np.all(np.abs(a) <= 5.0 + 1e-9)
        q, v = q + dt * v + 0.5 * dt * dt * a if level == codes.ACCELERATION else q + dt * x, v + dt * a
        inside = np.abs(q) <= 1.0 + 1e-9
        assert np.all(inside[back])
        back |= np.abs(q) <= 1.0
    assert np.all(back)


@given(
    q=st.floats(-5.0, 5.0),
    v=st.floats(-20.0, 20.0),
    dt=st.sampled_from(DTS),
    level=st.sampled_from((codes.ACCELERATION, codes.VELOCITY)),
    conversion=st.sampled_from((codes.VIABILITY, codes.JIN, codes.ONE_STEP)),
    q_max=st.sampled_from((1.0, np.inf)),
    v_max=st.sampled_from((0.7, np.inf)),
    a_max=st.floats(0.1, 50.0),
)
@settings(max_examples=200, deadline=None, derandomize=True)
def test_bounds_never_cross_whatever_the_state(q, v, dt, level, conversion, q_max, v_max, a_max):
    limits = {"q_min": -q_max, "q_max": q_max, "v_max": v_max, "a_max": a_max}
    lb, ub = interval(joints(limits, dt, level, conversion), q, v)
    assert np.all(lb <= ub)
    if level == codes.ACCELERATION or conversion == codes.VIABILITY:
        assert np.all(np.isfinite(lb)) and np.all(np.isfinite(ub))


def by_formula(level, v, d, v_max, a_max, dt):
    """The upper end within the limits as its docstring has it, with no way around the root, (64,)."""
    if level == codes.VELOCITY:
        steps = np.maximum(1.0, np.ceil(0.5 * (np.sqrt(1.0 + 8.0 * d / (a_max * dt * dt)) - 1.0)))
        braking = d / (steps * dt) + 0.5 * a_max * dt * (steps - 1.0)
        return np.maximum(np.minimum(np.minimum(v_max, braking), v + a_max * dt), v - a_max * dt)
    room = np.maximum(d - 0.5 * v * dt, 0.0)
    steps = np.maximum(1.0, np.ceil(0.5 * (np.sqrt(1.0 + 8.0 * room / (a_max * dt * dt)) - 1.0)))
    after = room / (steps * dt) + 0.5 * a_max * dt * (steps - 1.0)
    keeps = np.where(0.5 * v * dt > d, -v * v / (2.0 * np.maximum(d, 1e-300)), (after - v) / dt)
    bound = np.minimum(np.minimum(a_max, (v_max - v) / dt), keeps)
    return np.maximum(bound, -a_max)


@pytest.mark.parametrize("level", [codes.VELOCITY, codes.ACCELERATION])
@pytest.mark.parametrize("place", ["anywhere", "at a limit", "in the middle"])
@pytest.mark.parametrize("speed", [1.0, 0.01])
@pytest.mark.parametrize("dt", DTS)
def test_each_end_is_its_formula(level, place, speed, dt):
    rng = np.random.default_rng(11)
    for _ in range(12):
        limits = random_limits(rng, dt)
        K = joints(limits, dt, level)
        where = {"anywhere": (0.0, 1.0), "at a limit": (0.0, 0.02), "in the middle": (0.4, 0.6)}[place]
        share = rng.uniform(*where, JOINTS)
        share = np.where(rng.random(JOINTS) < 0.5, share, 1.0 - share)
        q = limits["q_min"] + share * (limits["q_max"] - limits["q_min"])
        v = speed * rng.uniform(-1.0, 1.0, JOINTS) * limits["v_max"]
        K.state.q[:], K.state.v[:] = q, v
        above, below = limits["q_max"] - q, q - limits["q_min"]
        hi = by_formula(level, v, above, limits["v_max"], limits["a_max"], dt)
        lo = -by_formula(level, -v, below, limits["v_max"], limits["a_max"], dt)
        whole = lo <= hi  # else the joint cannot stop in time
        size = 1.0 + np.abs(hi) + np.abs(lo)
        bounds.intervals(K)
        assert np.all(np.abs(K.qp.lb[:JOINTS] - lo)[whole] <= 1e-9 * size[whole])
        assert np.all(np.abs(K.qp.ub[:JOINTS] - hi)[whole] <= 1e-9 * size[whole])
