"""The argument ``engine`` of batches, which chose an engine while there were two."""

import warnings

from ftqp.core.errors import InputError

NAMES = ("kernel", "numba")
"""What the compiled engine, the only one, is and was called."""


def check_engine(engine: str | None) -> None:
    """Warn whoever still names the only engine, and refuse any other."""
    if engine is None:
        return
    if engine == "jax":
        raise InputError("engine 'jax' is gone; leave engine out, as the compiled one gives the same results")
    if engine not in NAMES:
        raise InputError(f"engine is {engine!r:.40}, expected none; leave it out, there is one engine now")
    warnings.warn(
        f"engine={engine!r} is deprecated and has no effect; leave it out, as there is one engine now",
        DeprecationWarning,
        stacklevel=3,
    )
