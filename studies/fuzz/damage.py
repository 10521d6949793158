"""What a broken sensor, cable or program makes of numbers: each kind of damage by its name."""

from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
DENORMAL = 5e-324
HUGE = 1e308

Damage = Callable[[Array, np.random.Generator, Array], Array]
"""Of the true numbers, a generator, and the numbers at the beginning of the burst: a new array."""


def _put(x: Array, rng: np.random.Generator, value: float) -> Array:
    y = x.copy()
    y[int(rng.integers(len(y)))] = value
    return y


def _add(x: Array, rng: np.random.Generator, value: float) -> Array:
    y = x.copy()
    y[int(rng.integers(len(y)))] += value
    return y


def _swapped(x: Array, rng: np.random.Generator, _: Array) -> Array:
    y = x.copy()
    i, j = rng.integers(len(y), size=2)
    y[i], y[j] = x[j], x[i]
    return y


def _flipped(x: Array, rng: np.random.Generator, _: Array) -> Array:
    y = x.copy()
    y[int(rng.integers(len(y)))] *= -1.0
    return y


def _bit(x: Array, rng: np.random.Generator, _: Array) -> Array:
    y = x.copy()
    y.view(np.uint64)[int(rng.integers(len(y)))] ^= np.uint64(1) << np.uint64(rng.integers(64))
    return y


KINDS: dict[str, Damage] = {
    "noise": lambda x, rng, _: x + rng.normal(0.0, 10.0 ** rng.uniform(-9.0, -3.0), len(x)),
    "one ulp": lambda x, rng, _: np.nextafter(x, rng.choice((-np.inf, np.inf))),
    "negative zero": lambda x, rng, _: np.where(x == 0.0, -0.0, x),
    "denormal": lambda x, rng, _: _put(x, rng, DENORMAL * float(rng.integers(-3, 4))),
    "all denormal": lambda x, rng, _: np.full_like(x, DENORMAL),
    "rounded": lambda x, rng, _: np.round(x, int(rng.integers(1, 5))),
    "nan": lambda x, rng, _: _put(x, rng, np.nan),
    "all nan": lambda x, rng, _: np.full_like(x, np.nan),
    "infinite": lambda x, rng, _: _put(x, rng, np.inf if rng.random() < 0.5 else -np.inf),
    "huge": lambda x, rng, _: _put(x, rng, HUGE if rng.random() < 0.5 else -HUGE),
    "all huge": lambda x, rng, _: np.full_like(x, HUGE) * rng.choice((-1.0, 1.0), len(x)),
    "large": lambda x, rng, _: _put(x, rng, float(rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(1.0, 200.0))),
    "glitch": lambda x, rng, _: _add(x, rng, float(rng.normal(0.0, 10.0 ** rng.uniform(-4.0, 1.0)))),
    "drift": lambda x, rng, first: x + (x - first) * rng.uniform(-2.0, 2.0),
    "wrapped": lambda x, rng, _: _add(x, rng, float(rng.choice((-2.0, 2.0)) * np.pi)),
    "half turn": lambda x, rng, _: _add(x, rng, np.pi),
    "dead": lambda x, rng, _: _put(x, rng, 0.0),
    "all dead": lambda x, rng, _: np.zeros_like(x),
    "frozen": lambda x, rng, first: first.copy(),
    "sign": _flipped,
    "all signs": lambda x, rng, _: -x,
    "degrees": lambda x, rng, _: np.degrees(x),
    "swapped": _swapped,
    "reversed": lambda x, rng, _: x[::-1].copy(),
    "bit": _bit,
    "biased": lambda x, rng, first: x + 1e-3 * np.sign(first),
}
"""Damage of any array of numbers by name."""


def _turned(x: Array, rng: np.random.Generator, _: Array) -> Array:
    """A pose whose rotation is none: scaled, mirrored, transposed, zero, or skewed a little."""
    T = x.reshape(4, 4).copy()
    way = int(rng.integers(6))
    if way == 0:
        T[:3, :3] *= 10.0 ** rng.uniform(-9.0, 9.0)
    elif way == 1:
        T[:3, 0] *= -1.0
    elif way == 2:
        T[:] = T.T.copy()
    elif way == 3:
        T[:3, :3] = 0.0
    elif way == 4:
        T[:3, :3] += rng.normal(0.0, 10.0 ** rng.uniform(-8.0, -3.0), (3, 3))
    else:
        T[3] = rng.normal(0.0, 1.0, 4)
    return T.ravel()


def _far_away(x: Array, rng: np.random.Generator, _: Array) -> Array:
    T = x.reshape(4, 4).copy()
    T[:3, 3] += rng.normal(0.0, 10.0 ** rng.uniform(-3.0, 1.0), 3)
    return T.ravel()


POSE_KINDS: dict[str, Damage] = {
    **KINDS,
    "no rotation": _turned,
    "far away": _far_away,
}
"""Damage of a pose, (16,) by rows: that of numbers, and two of its own."""


def bursts(rng: np.random.Generator, ticks: int, share: float, names: tuple[str, ...]) -> list[str | None]:
    """What hurts at each tick: about ``share`` of them in bursts of one kind, mostly short."""
    result: list[str | None] = [None] * ticks
    k = int(rng.geometric(share / 3.0))
    while k < ticks:
        length = int(rng.geometric(0.4)) if rng.random() < 0.9 else int(rng.integers(10, 60))
        name = names[int(rng.integers(len(names)))]
        result[k : k + length] = [name] * len(result[k : k + length])
        k += length + int(rng.geometric(share / 3.0))
    return result
