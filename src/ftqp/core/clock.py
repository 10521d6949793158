"""The one clock; nothing that a planner returns depends on it, unless its solver is given a time limit."""

from time import perf_counter_ns


def now() -> int:
    """A monotonic time in nanoseconds, for measuring durations only."""
    return perf_counter_ns()
