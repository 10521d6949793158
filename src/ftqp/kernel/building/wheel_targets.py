"""What a wheel can be built for on another machine: the classes of processors, and how it is linked."""

import platform
from dataclasses import dataclass
from typing import Any, Final

from ftqp.kernel.compiled.library import LEVELS


@dataclass(frozen=True, slots=True)
class WheelTarget:
    """A system and a machine that a library is built for."""

    system: str  # As platform.system() says there
    machine: str  # As platform.machine() says there
    triple: str  # LLVM's
    zig: str  # Architecture and system as zig names them, with the oldest version of the system

    @property
    def levels(self) -> dict[str, tuple[str, ...]]:
        """The classes of its processors by LLVM's name."""
        return LEVELS[self.machine]

    @property
    def facts(self) -> dict[str, Any]:
        """What the manifest says of it, in the place of this machine."""
        return {"system": self.system, "machine": self.machine, "target": self.zig}


TARGETS: Final = {
    "x86_64-linux": WheelTarget("Linux", "x86_64", "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17"),
    "aarch64-linux": WheelTarget("Linux", "aarch64", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17"),
    "aarch64-macos": WheelTarget("Darwin", "arm64", "arm64-apple-macosx11.0.0", "aarch64-macos.11.0"),
}
"""By the names that ``--target`` takes; older systems than these are not served."""


def is_this_machine(target: WheelTarget) -> bool:
    """Whether a target is this machine, for which nothing else has to be said."""
    return (target.system, target.machine) == (platform.system(), platform.machine())
