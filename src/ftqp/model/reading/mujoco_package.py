"""The one place where MuJoCo is imported, which is optional."""

from logging import getLogger

from ftqp.core.errors import MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.core.safe_path import safe_path

__all__ = ["mujoco"]

try:
    with safe_path():  # its glfw starts a Python when it is imported
        import mujoco
except ImportError as error:
    what = "MuJoCo, which reads MJCF and simulates arms,"
    raise MissingPackage(what, "mujoco", remedy_for_extra("sim")) from error
if mujoco.get_mju_user_warning() is None:  # else MuJoCo writes MUJOCO_LOG.TXT where the user works
    mujoco.set_mju_user_warning(getLogger("ftqp").warning)
