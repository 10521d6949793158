"""The processor that machine code is made for."""

from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm


@dataclass(frozen=True, slots=True)
class Target:
    """A processor as LLVM names it.

    Attributes:
        triple: architecture, vendor and operating system.
        cpu: the processor's name; code for it may use everything that such a processor has.
        features: what to add or leave out, as LLVM writes it (``+avx2,-avx512f``).
    """

    triple: str
    cpu: str
    features: str = ""

    def machine(self) -> Any:
        """LLVM's generator of position-independent code for it."""
        initialise()
        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu, features=self.features, opt=3, reloc="pic", codemodel="default"
        )


def initialise() -> None:
    """Set LLVM up for this machine; it may be called again."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()


def this_machine() -> Target:
    """The processor of this machine with all that it offers."""
    initialise()
    try:
        features = llvm.get_host_cpu_features().flatten()
    except RuntimeError:
        features = ""
    return Target(triple=_triple(), cpu=llvm.get_host_cpu_name(), features=features)


def baseline(cpu: str) -> Target:
    """A class of processors by LLVM's name, for example ``x86-64-v3``."""
    initialise()
    return Target(triple=_triple(), cpu=cpu)


def _triple() -> str:
    return str(llvm.get_process_triple())
