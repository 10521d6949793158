"""What installing does beyond copying: the kernel is compiled and linked into one library, ``ftqp/_kernel``.

``pip install .`` builds it for the class of processors that this machine belongs to, ``pip install --editable
.`` into the source tree. ``FTQP_LEVELS`` names other classes, with commas between; ``make wheel`` builds two.
With ``FTQP_LEVELS=none`` nothing is built here. ``FTQP_TARGET`` names another system, as
``python -m ftqp.kernel.building --target`` takes it. Where it cannot be built, ftqp runs as plain Python.
"""

import importlib.util
import json
import os
import platform
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

MAKER = "ftqp.kernel.building"
SERVED = {"Linux": "manylinux_2_17", "Darwin": "macosx_11_0"}
"""The oldest systems that a library runs on which is linked for a named target."""
OWN = {
    ("Linux", "x86_64"): "x86_64-linux",
    ("Linux", "aarch64"): "aarch64-linux",
    ("Darwin", "arm64"): "aarch64-macos",
}
"""The target that a machine itself is."""


def target_here() -> str:
    """The target of this machine, where zig can link for its oldest systems; else empty."""
    here = OWN.get((platform.system(), platform.machine()), "")
    is_musl = platform.system() == "Linux" and platform.libc_ver()[0] != "glibc"
    return "" if is_musl or importlib.util.find_spec("ziglang") is None else here


def tag_of(manifest: dict[str, Any], target: str) -> str:
    """The tag of a wheel whose library has this manifest; one library serves every Python."""
    if not target:  # linked against what lies on this machine
        return f"py3-none-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
    return f"py3-none-{SERVED[manifest['system']]}_{manifest['machine']}"


class Addresses(MetadataHookInterface):
    """The addresses of the project: those of the repository that makes the release, which names itself."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, Any]) -> None:
        """Adds them; elsewhere than on the release's machine there are none."""
        name = os.environ.get("GITHUB_REPOSITORY", "")
        home = f"{os.environ.get('GITHUB_SERVER_URL', 'https://github.com')}/{name}"
        metadata["urls"] = {
            "Source": home,
            "Changelog": f"{home}/blob/main/CHANGELOG.md",
            "Issues": f"{home}/issues",
        } if name else {}  # fmt: skip


class Kernel(BuildHookInterface):
    """Builds the library, puts it into the wheel, and names the platform that it is for."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Builds it and adds its files; hatchling calls this before it packs."""
        levels, target = os.environ.get("FTQP_LEVELS", ""), os.environ.get("FTQP_TARGET") or target_here()
        if self.target_name != "wheel" or levels == "none":
            return
        root = Path(self.root)
        editable = version == "editable"
        out = root / "src" / "ftqp" / "_kernel" if editable else root / "build" / "wheel"
        command = [sys.executable, "-P", "-m", MAKER, "--out", str(out), "--levels", levels]
        command += ["--target", target] if target and not editable else []
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
        if done.returncode and os.environ.get("FTQP_TARGET"):
            raise RuntimeError(f"no wheel for {target}: {done.stderr.strip()}")
        (self.app.display_info if done.returncode == 0 else self.app.display_warning)(done.stderr.strip())
        libraries = [] if editable else sorted(out.glob("kernel-*"))
        for file in [] if editable else [out / "manifest.json", *libraries]:
            build_data["force_include"][str(file)] = f"ftqp/_kernel/{file.name}"
        if libraries:
            build_data["pure_python"] = False
            build_data["tag"] = tag_of(json.loads((out / "manifest.json").read_bytes()), target)
