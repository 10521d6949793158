"""A path that begins anew: nothing of it is reached, and nothing holds it."""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def begin(path: Any) -> None:
    """The progress at 0 and its rate not yet known, free to run at full speed."""
    path.progress = 0.0
    path.rate = -1.0
    path.limit = 1.0
    path.speed = 0.0
    path.driven = path.found = 0
