"""What installing does beyond copying: the kernel is compiled and linked into one library, ``ftqp/_kernel``.

``pip install .`` builds it for the class of processors that this machine belongs to, ``pip install --editable
.`` into the source tree. ``FTQP_LEVELS`` names other classes, with commas between; ``make wheel`` builds two.
With ``FTQP_LEVELS=none`` nothing is built here. Where it cannot be built, ftqp runs as plain Python.
"""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MAKER = "ftqp.kernel.building"


class Kernel(BuildHookInterface):
    """Builds the library, puts it into the wheel, and names the platform that it is for."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Builds it and adds its files; hatchling calls this before it packs."""
        levels = os.environ.get("FTQP_LEVELS", "")
        if self.target_name != "wheel" or levels == "none":
            return
        root = Path(self.root)
        editable = version == "editable"
        out = root / "src" / "ftqp" / "_kernel" if editable else root / "build" / "wheel"
        command = [sys.executable, "-P", "-m", MAKER, "--out", str(out), "--levels", levels]
        path = os.pathsep.join(filter(None, [str(root / "src"), os.environ.get("PYTHONPATH", "")]))
        done = subprocess.run(
            [*command, *([] if editable else ["--wheel"])],
            env={**os.environ, "PYTHONPATH": path},
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode == 130:
            raise KeyboardInterrupt
        (self.app.display_info if done.returncode == 0 else self.app.display_warning)(done.stderr.strip())
        libraries = [] if editable else sorted(out.glob("kernel-*"))
        for file in [] if editable else [out / "manifest.json", *libraries]:
            build_data["force_include"][str(file)] = f"ftqp/_kernel/{file.name}"
        if libraries:
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{platform}"
