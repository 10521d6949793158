"""How many threads share out work on many arms or many QPs."""

import os


def thread_count() -> int:
    """``NUMBA_NUM_THREADS`` where it is a whole number from 1, else the number of cores."""
    given = os.environ.get("NUMBA_NUM_THREADS", "")
    return int(given) if given.isdecimal() and int(given) > 0 else os.cpu_count() or 1
