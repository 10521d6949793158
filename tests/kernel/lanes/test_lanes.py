"""Several arms in a vector register: numbers, arrays, records, and functions typed twice."""

import numpy as np
import pytest

from ftqp.kernel.jit import COMPILED, as_mask, bits, carray, jit, lane_of, lane_record, pointer, put_lane
from ftqp.kernel.lanes.membership import may_have_acceleration, may_have_velocity
from ftqp.kernel.layout.lane_rooms import lanes_memory
from ftqp.kernel.maths.elementary import any_of, floor, larger, select, smaller, sqrt
from ftqp.kernel.maths.trigonometry import sin_cos
from ftqp.kernel.rows.failed_joints import braked_velocity, lock_rate
from ftqp.kernel.rows.joint_intervals import braking, viability

compiled = pytest.mark.skipif(not COMPILED, reason="lanes are compiled code")
INPUTS = np.concatenate([np.linspace(-9.0, 9.0, 37), [0.0, -0.0, 1e-12, 4e4, -4e4, 0.5 * np.pi, np.nan]])


@jit
def mixture(x, y):
    """Every operator and elementary function in one number."""
    s, c = sin_cos(x)
    z = x + y * 2.0 - 1 / (3.0 + abs(y)) + (-x) * 0.5
    z -= sqrt(abs(z)) * floor(x)
    z *= 0.25
    z += select((x > y) & ~(x >= 3.0) | (y < -2.0), larger(s, y), smaller(c, 2.0))
    return z / 1.5, s, c


DTYPE = np.dtype(
    [("room", [("x", "f8", (2, 8)), ("y", "f8", (8,)), ("out", "f8", (3, 8)), ("A", "f8", (2, 3, 8))])]
)


def entry(width):
    """A function of compiled code over lanes of that width and a shared record."""
    import numba

    dtype = np.dtype(
        [
            (
                "room",
                [(n, "f8", (*s, width)) for n, s in (("x", (2,)), ("y", ()), ("out", (3,)), ("A", (2, 3)))],
            )
        ]
    )
    shared = np.dtype([("room", [("factor", "f8"), ("count", "i8")]), ("other", [("n", "i8")])])
    at = lane_record(width, dtype)

    @numba.njit(error_model="numpy")
    def run(lanes, record):
        L = at(lanes, carray(pointer(record), 1, shared)[0])
        room = L.room
        room.out[0], room.out[1], room.out[2] = mixture(room.x[0], room.x[1])
        room.y = 0.0
        for k in range(L.other.n):
            row = room.A[k]
            for j in range(3):
                row[j] = room.x[k] * room.factor
                room.y = room.y + room.A[k, j]
        room.count = room.count + 1
        inside = as_mask(L, 5)
        put_lane(room.x, 1, width - 1, lane_of(room.out, 1, 0))
        return bits((room.x[0] > 0.0) & inside) + 1000 * any_of(room.x[0] > 1e3)

    return run, np.zeros(1, dtype), np.zeros(1, shared)


@compiled
@pytest.mark.parametrize("width", [4, 8])
def test_lanes_are_so_many_numbers(width):
    run, lanes, record = entry(width)
    size = 8 * width
    memory = np.zeros(lanes.itemsize + size, dtype=np.uint8)
    begin = -memory.ctypes.data % size
    lanes = memory[begin : begin + lanes.itemsize].view(lanes.dtype)
    record["room"]["factor"], record["other"]["n"] = 3.0, 2
    for first in range(0, len(INPUTS) - width, 3):
        x, y = INPUTS[first : first + width], INPUTS[::-1][first : first + width]
        lanes["room"]["x"][0] = x, y
        found = run(lanes.ctypes.data, record.ctypes.data)
        expected = np.array(
            [mixture.py_func(np.float64(a), np.float64(b)) for a, b in zip(x, y, strict=True)]
        )
        np.testing.assert_allclose(lanes["room"]["out"][0].T, expected, rtol=1e-14, atol=1e-14)
        np.testing.assert_allclose(lanes["room"]["y"][0], 9.0 * (x + y), rtol=1e-14)
        assert found % 1000 == sum(1 << lane for lane in (0, 2) if x[lane] > 0.0)
        assert (found >= 1000) == bool((x > 1e3).any())
        changed = lanes["room"]["x"][0, 1, width - 1]
        np.testing.assert_array_equal(changed, lanes["room"]["out"][0, 1, 0])
    assert record["room"]["count"][0] == len(range(0, len(INPUTS) - width, 3))


def test_sine_and_cosine_are_those_of_numpy():
    angles = np.concatenate(
        [np.linspace(-20.0, 20.0, 4001), np.random.default_rng(1).uniform(-1e5, 1e5, 4000)]
    )
    found = np.array([sin_cos(angle) for angle in angles])
    np.testing.assert_allclose(
        found, np.stack([np.sin(angles), np.cos(angles)], axis=1), rtol=0.0, atol=4e-16
    )


def test_memory_of_lanes_begins_where_a_register_may():
    for width in (4, 8):
        memory, begin = lanes_memory(8, width)
        assert begin % (8 * width) == 0 and begin >= memory.ctypes.data


@pytest.mark.parametrize("seed", range(4))
def test_membership_is_never_wider_than_the_interval(seed):
    rng = np.random.default_rng(seed)
    seen = np.zeros(4, dtype=int)
    for _ in range(4000):
        dt = 10.0 ** rng.uniform(-3.5, -1.7)
        a_max, v_max = rng.uniform(0.5, 20.0), rng.uniform(0.2, 3.0)
        a_brake = a_max * rng.uniform(0.2, 1.0)
        v, d = rng.uniform(-1.0, 1.0) * v_max, rng.choice([0.0, 1e-4, 1e-2, 1.0]) * rng.uniform(0.0, 1.0)
        x = v + rng.uniform(-1.5, 1.5) * a_max * dt
        inside, outside = (
            may_have_velocity(x, v, d, v_max, a_max, a_brake, dt),
            braking(v, d, v_max, a_max, a_brake, dt)[0],
        )
        seen[0] += inside
        seen[1] += x <= outside
        assert not inside or x <= outside + 1e-12
        a = rng.uniform(-1.5, 1.5) * a_max
        inside, outside = (
            may_have_acceleration(a, v, d, v_max, a_max, a_brake, dt),
            viability(v, d, v_max, a_max, a_brake, dt)[0],
        )
        seen[2] += inside
        seen[3] += a <= outside
        assert not inside or a <= outside + 1e-9 / dt
    assert seen[0] > 0.4 * seen[1] and seen[2] > 0.4 * seen[3], "it is not so narrow as to be of no use"


def test_brake_ends_at_rest_before_the_limit():
    v, q, dt = 1.0, 0.0, 1e-2
    for _ in range(2000):
        rate = lock_rate(v, 0.3 - q, 0.5, 9.0, dt)
        after = braked_velocity(v, rate, dt)
        q, v = q + 0.5 * dt * (v + after), after
    assert v == 0.0 and 0.25 < q <= 0.3
