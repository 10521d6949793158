"""A stop that is latched: the arm is brought to rest and stays so until someone resumes."""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def latch(watch: Any, reason: int) -> None:
    """Latch a stop; whoever does asks before whether one is latched, whose reason stays."""
    watch.latched = 1
    watch.reason = reason
