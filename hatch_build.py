"""What the wheel's build does beyond copying: take in the kernel compiled ahead, if one was made.

``make wheel`` makes it (``build_wheel.py``) and names its folder in ``FTQP_KERNEL_AHEAD``. Without it the
wheel is the same for every platform and the kernel is compiled where it is used.
"""

import os
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class KernelAhead(BuildHookInterface):
    """Puts the library and its manifest into the wheel and names the platform that they are for."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Adds the folder's files; hatchling calls this before it builds."""
        folder = os.environ.get("FTQP_KERNEL_AHEAD")
        if self.target_name != "wheel" or not folder:
            return
        for file in ("kernel.so", "manifest.json"):
            build_data["force_include"][str(Path(folder).resolve() / file)] = f"ftqp/kernel/ahead/{file}"
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform}"
