"""How many threads share out work on many arms or many QPs, and how they do."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

PORTIONS = 8
"""Portions that work is shared out in, for each thread, so that none waits long for another at the end."""


def thread_count() -> int:
    """``NUMBA_NUM_THREADS`` where it is a whole number from 1, else the number of cores."""
    given = os.environ.get("NUMBA_NUM_THREADS", "")
    return int(given) if given.isdecimal() and int(given) > 0 else os.cpu_count() or 1


def share_out(work: Callable[[int, int], None], count: int, threads: int | None = None) -> None:
    """Do work(first, last) on portions of ``count`` things, on so many threads; None: ``thread_count``."""
    workers = thread_count() if threads is None else threads
    portions = min(count, PORTIONS * workers) if workers > 1 else 1
    if portions <= 1:
        work(0, count)
        return
    ends = [portion * count // portions for portion in range(portions + 1)]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(work, ends[:-1], ends[1:]))
