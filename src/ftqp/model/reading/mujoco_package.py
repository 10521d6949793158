"""The one place where MuJoCo is imported, which is optional."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from ftqp.core.errors import MissingPackage
from ftqp.core.extras import remedy_for_extra

__all__ = ["mujoco"]

_SAFE_PATH = "PYTHONSAFEPATH"


@contextmanager
def _own_modules_only() -> Iterator[None]:
    """While entered, a Python that is started imports nothing from the folder in which the user works.

    MuJoCo's glfw starts one when it is imported, as ``python -c``, which would.
    """
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


try:
    with _own_modules_only():
        import mujoco
except ImportError as error:
    raise MissingPackage("MuJoCo", "mujoco", remedy_for_extra("sim")) from error
