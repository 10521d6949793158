"""The processors that machine code is made for."""

import platform
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm

from ftqp.kernel.compiled.levels import LEVELS, level_here


@dataclass(frozen=True, slots=True)
class Target:
    """A class of processors.

    Attributes:
        triple: architecture, vendor and operating system.
        cpu: LLVM's name of the class; code for it may use everything that such a processor has.
    """

    triple: str
    cpu: str

    def machine(self) -> Any:
        """LLVM's generator of position-independent code for it."""
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu, opt=3, reloc="pic", codemodel="default"
        )


def target(cpu: str | None = None) -> Target:
    """A class of processors of this architecture; the best that this machine belongs to if none is named.

    Raises:
        LookupError: no class is named for this architecture, or not this one.
    """
    found = level_here() if cpu is None else cpu
    if found not in LEVELS.get(platform.machine(), {}):
        raise LookupError(f"no class of processors is named for {platform.machine()} {cpu or ''}".rstrip())
    return Target(triple=str(llvm.get_process_triple()), cpu=found)
