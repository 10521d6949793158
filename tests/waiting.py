"""Waiting for what another thread does."""

from time import monotonic, sleep


def until(holds, longest=60.0):
    """Wait until something is true, for so many seconds on a slow machine."""
    end = monotonic() + longest
    while not holds():
        assert monotonic() < end, "nothing happened"
        sleep(0.01)
