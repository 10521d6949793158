"""The processors that machine code is made for."""

import platform
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm

from ftqp.kernel.compiled.library import LEVELS, level_here

WASM_FEATURES = "+simd128,+bulk-memory"
"""What every browser has since 2021: lanes of two doubles, and copies of memory as instructions."""


@dataclass(frozen=True, slots=True)
class Target:
    """A class of processors.

    Attributes:
        triple: architecture, vendor and operating system.
        cpu: LLVM's name of the class; code for it may use everything that such a processor has.
    """

    triple: str
    cpu: str

    @property
    def architecture(self) -> str:
        """The first part of the triple."""
        return self.triple.partition("-")[0]

    @property
    def is_foreign(self) -> bool:
        """Whether memory is laid out as on another processor with addresses of 64 bits.

        numba's code takes addresses for 64 bits long, so that its layout is kept where they are shorter.
        """
        own = str(llvm.get_process_triple()).partition("-")[0]
        return self.architecture not in (own, "wasm32")

    def machine(self) -> Any:
        """LLVM's generator of code for it, position-independent where libraries are shared."""
        wasm = self.architecture == "wasm32"
        if wasm or self.is_foreign:
            llvm.initialize_all_targets()
            llvm.initialize_all_asmprinters()
        else:
            llvm.initialize_native_target()
            llvm.initialize_native_asmprinter()
        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu, features=WASM_FEATURES if wasm else "", opt=3,
            reloc="static" if wasm else "pic", codemodel="default",
        )  # fmt: skip


def target(cpu: str | None = None) -> Target:
    """A class of processors of this architecture; the best that this machine belongs to if none is named."""
    found = level_here() if cpu is None else cpu
    if found not in LEVELS.get(platform.machine(), {}):
        raise LookupError(f"no class of processors is named for {platform.machine()} {cpu or ''}".rstrip())
    return Target(triple=str(llvm.get_process_triple()), cpu=found)
