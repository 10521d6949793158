"""The clock counts nanoseconds and never runs backwards."""

from ftqp.core.clock import now


def test_clock_never_runs_backwards():
    times = [now() for _ in range(1000)]
    assert times == sorted(times)
    assert all(isinstance(t, int) for t in times)
