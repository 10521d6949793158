"""ftqp: an arm keeps its task through a joint failure.

Names are loaded when they are first used: ``import ftqp`` loads numpy only; pinocchio comes with the first
robot.
"""

import sys

# Python puts the current folder on the path for ``python -m ftqp``, and a stranger's numpy.py may lie in it.
if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].removeprefix("-m").partition(".")[0] == "ftqp"
    and not (sys.flags.safe_path or sys.path[0] == __file__.rpartition("ftqp")[0][:-1])
):
    del sys.path[0]

from ast import ImportFrom, parse
from importlib import import_module
from pkgutil import get_data
from typing import Any

from ftqp.core.picture import PAINTERS

__version__ = "0.4.0"
_HOMES = {
    one.asname: (line.module, one.name)
    for line in parse(get_data(__name__, "__init__.pyi") or b"").body
    if isinstance(line, ImportFrom)
    for one in line.names
    if one.asname and line.module
}
"""The module and the name there of every public name, as the stub has them."""
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'ftqp' has no attribute {name!r}")
    home, own = _HOMES[name]
    found = None if home == __name__ else getattr(import_module(home), own, None)
    return import_module(f"{home}.{own}") if found is None else found


def _painter(home: str, name: str) -> Any:
    """A function of the pictures, which are loaded when one is drawn."""
    return lambda *given: getattr(import_module(home), name)(*given)


PAINTERS |= {
    "robot": _painter("ftqp.viz.figures.arm_picture", "robot_picture"),
    "run": _painter("ftqp.viz.figures.run_figures", "run_picture"),
    "coverage": _painter("ftqp.viz.figures.study_pictures", "draw_coverage"),
}


def __dir__() -> list[str]:
    return sorted(__all__)
