"""What a library can be built for on another machine: the classes of processors, and how it is linked."""

import platform
from dataclasses import dataclass
from typing import Any, Final

from ftqp.kernel.compiled.library import LEVELS


class CannotBuild(Exception):
    """The kernel cannot be built here; the message says why."""


@dataclass(frozen=True, slots=True)
class BuildTarget:
    """A system and a machine that a library is built for."""

    triple: str | None  # LLVM's; None is this machine's
    zig: str  # Architecture, system and C library as zig names them, with the oldest version of the system
    system: str = ""  # As platform.system() says there; of a wheel only
    machine: str = ""  # As platform.machine() says there; of a wheel only
    cpu: str = ""  # LLVM's name of the class of processors; empty is that of a wheel or of this machine

    @property
    def levels(self) -> dict[str, tuple[str, ...]]:
        """The classes of its processors by LLVM's name."""
        return LEVELS[self.machine]

    @property
    def facts(self) -> dict[str, Any]:
        """What the manifest says of it, in the place of this machine."""
        return {"system": self.system, "machine": self.machine, "target": self.zig}


TARGETS: Final = {
    "x86_64-linux": BuildTarget("x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", "Linux", "x86_64"),
    "aarch64-linux": BuildTarget("aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", "Linux", "aarch64"),
    "aarch64-macos": BuildTarget("arm64-apple-macosx11.0.0", "aarch64-macos.11.0", "Darwin", "arm64"),
}
"""Wheels by the names that ``--target`` takes; older systems than these are not served."""


def is_this_machine(target: BuildTarget) -> bool:
    """Whether a target is this machine, for which nothing else has to be said."""
    return (target.system, target.machine) == (platform.system(), platform.machine())
