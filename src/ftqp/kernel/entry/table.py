"""The ways in from Python: every entry point, who makes it, and what it takes."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry point.

    Attributes:
        name: unique.
        module: where its factory is; imported only when machine code has to be made.
        arguments: one letter each: ``i`` a whole number, ``o`` an object with a buffer.
        nogil: whether it runs without the interpreter's lock, so that threads can share the work.

    The factory has the entry's name and takes the capacity of the records; it returns the plain function.
    """

    name: str
    module: str
    arguments: str
    nogil: bool = False


_STEPS, _EXTERNAL = "ftqp.kernel.entry.steps", "ftqp.kernel.entry.external_steps"
_NETWORK, _CLOSED = "ftqp.kernel.entry.network_steps", "ftqp.kernel.entry.closed_form_steps"
_ARM, _ALONE = "ftqp.kernel.entry.arm_entries", "ftqp.kernel.entry.alone"

ENTRIES: Final = {
    entry.name: entry
    for entry in (
        Entry("step", _STEPS, "ioooi"),
        Entry("step_rich", _STEPS, "ioooi"),
        Entry("step_path", _STEPS, "iiiioo"),
        Entry("step_base", _STEPS, "iioooi"),
        Entry("prepare_clock", _EXTERNAL, "iioooi"),
        Entry("finish_clock", _EXTERNAL, "iiii"),
        Entry("prepare_path", _EXTERNAL, "iiiiioo"),
        Entry("finish_path", _EXTERNAL, "iiiii"),
        Entry("prepare_base", _EXTERNAL, "iiioooi"),
        Entry("finish_base", _EXTERNAL, "iiiii"),
        Entry("network_clock", _NETWORK, "iiioooi"),
        Entry("network_path", _NETWORK, "iiiiiioo"),
        Entry("network_base", _NETWORK, "iiiioooi"),
        Entry("closed_form_clock", _CLOSED, "iioooi"),
        Entry("closed_form_base", _CLOSED, "iiioooi"),
        Entry("measures", _CLOSED, "ii"),
        Entry("resolve_reduced", _CLOSED, "i"),
        Entry("kappa", _CLOSED, "i"),
        Entry("kinematics", _ARM, "ii"),
        Entry("inverse_dynamics", _ARM, "ii"),
        Entry("torques", _ARM, "i"),
        Entry("rollout", "ftqp.kernel.entry.rollout", "i" * 12, nogil=True),
        Entry("solve_qp", _ALONE, "i"),
        Entry("kkt", _ALONE, "iiiiii"),
        Entry("solve_network", _ALONE, "i" * 11),
        Entry("solve_network_batch", _ALONE, "iiiiii", nogil=True),
    )
}
"""By name."""

ANY_SIZE: Final = 0
"""The capacity of entries that know no robot."""
