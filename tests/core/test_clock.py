"""The clock counts nanoseconds and never runs backwards."""

from time import perf_counter

from ftqp.core.clock import now


def test_clock_never_runs_backwards():
    times = [now() for _ in range(1000)]
    assert times == sorted(times)
    assert all(isinstance(t, int) for t in times)


def test_clock_counts_nanoseconds():
    outer, began, inner = perf_counter(), now(), perf_counter()
    while perf_counter() - inner < 1e-3:
        pass
    least, ended = perf_counter() - inner, now()
    most = perf_counter() - outer
    assert 0.99 * least <= 1e-9 * (ended - began) <= 1.01 * most
