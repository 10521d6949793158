"""The one place where MuJoCo is imported, which is optional."""

from ftqp.core.errors import MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.core.safe_path import safe_path

__all__ = ["mujoco"]

try:
    with safe_path():  # its glfw starts a Python when it is imported
        import mujoco
except ImportError as error:
    raise MissingPackage("MuJoCo", "mujoco", remedy_for_extra("sim")) from error
