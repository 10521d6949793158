"""Whether the installed numba can compile the lean way, and numba's own way where it cannot."""

import logging
from collections.abc import Callable
from functools import cache
from operator import index
from typing import Any

from ftqp.kernel.compiled.entry_point import EntryPoint

_LOG = logging.getLogger("ftqp")


@cache
def lean_is_possible() -> bool:
    """Whether a small probe, a helper and an entry point, compiles the lean way, links and gives its answer.

    Where it does not, helpers are compiled in numba's own way from then on, which a warning says once.
    """
    from numba.core.errors import NumbaError

    try:
        answer = _probe()
        problem = "" if answer == 44 else f"the probe gave {answer}"
    except (
        AssertionError,
        AttributeError,
        ImportError,
        LookupError,
        NumbaError,
        RuntimeError,
        TypeError,
        ValueError,
    ) as error:
        problem = f"{type(error).__name__}: {error}"
    if not problem:
        return True
    from ftqp.kernel.compiled.making.lean import use_plain_numba

    use_plain_numba()
    _LOG.warning("the kernel compiles slowly, and anew in every process, with this numba (%s)", problem)
    return False


def _probe() -> int:
    from ftqp.kernel.compiled.machine_code import linked_function
    from ftqp.kernel.compiled.making.emit import object_code
    from ftqp.kernel.compiled.making.lean import helper
    from ftqp.kernel.compiled.making.processor import this_machine

    @helper
    def _twice(value: int) -> int:
        return 2 * value

    def _probed(first: int, second: int) -> int:
        return _twice(first) + _twice(second)

    code = object_code(_probed, symbol="ftqp_probe", signature="ii", nogil=False, target=this_machine())
    function = linked_function(code, "ftqp_probe")
    return -1 if function is None else function(2, 20)


def plainly_compiled(entry: EntryPoint, capacity: int) -> Callable[..., int]:
    """An entry point compiled in numba's own way, for this process alone."""
    import numba

    from ftqp.kernel.compiled.making.lean import FAST

    signature = numba.int64(*(numba.int64,) * len(entry.signature))
    compiled: Any = numba.njit(signature, error_model="numpy", fastmath=FAST, nogil=entry.nogil)(
        entry.function(capacity)
    )
    kinds = tuple(id if letter == "o" else index for letter in entry.signature)

    def call(*arguments: Any) -> int:
        if len(arguments) != len(kinds):
            raise TypeError(f"{entry.name} takes {len(kinds)} arguments")
        answer: int = compiled(*(kind(one) for kind, one in zip(kinds, arguments, strict=True)))
        return answer

    return call
