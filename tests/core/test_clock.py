"""The clock counts nanoseconds and never runs backwards."""

from time import perf_counter

from ftqp.core.clock import now


def test_clock_never_runs_backwards():
    times = [now() for _ in range(1000)]
    assert times == sorted(times)
    assert all(isinstance(t, int) for t in times)


def test_clock_counts_nanoseconds():
    before, began = perf_counter(), now()
    while perf_counter() - before < 1e-3:
        pass
    ended = now()
    passed = perf_counter() - before
    assert 0.99e6 <= ended - began <= passed * 1e9 + 1e6
