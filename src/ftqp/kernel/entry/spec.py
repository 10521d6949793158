"""Entry points made of formulas: what one takes is said once, and its addresses become records and arrays.

A specification names the arguments in their order, with spaces between. ``K:record`` is the address of a
record of that kind, ``q:f8[count,n]`` that of an array, whose shape may name other arguments and what is in
records, ``q:object`` a Python object, and a name alone a whole number.
"""

import re
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Final, NamedTuple

import numpy as np

from ftqp.kernel.layout.enums import JOINTS
from ftqp.kernel.layout.record import KINDS, dtype

NUMBERS: Final = {"f8": np.dtype(np.float64), "i8": np.dtype(np.int64), "i1": np.dtype(np.int8)}
OBJECT: Final = "object"
_ARGUMENT: Final = re.compile(r"(\w+)(?::(\w+)(?:\[(\S+)\])?)?")


class Spec(NamedTuple):
    """What an entry point takes, and the formula that it calls.

    Attributes:
        module: Where the names in ``call`` and ``first`` are found.
        takes: Its arguments.
        call: The call of the formula, which returns a number, a truth value or nothing (0).
        first: A call before it that may find a mistake (negative), which is then the answer.
    """

    module: str
    takes: str
    call: str
    first: str = ""

    def arguments(self) -> Iterator[tuple[str, str, str]]:
        """Name, kind (empty for a whole number) and shape (empty but for arrays) of each argument."""
        for word in self.takes.split():
            found = _ARGUMENT.fullmatch(word)
            if found is None or not {found[2]} <= {None, OBJECT, *KINDS, *NUMBERS}:
                raise ValueError(f"{word!r} in {self.takes!r} is no argument of an entry point")
            yield found[1], found[2] or "", found[3] or ""

    @property
    def signature(self) -> str:
        """A letter an argument, as an ``EntryPoint`` has them."""
        return "".join("o" if kind == OBJECT else "i" for _, kind, _ in self.arguments())

    def function(self, name: str, joints: int = JOINTS) -> Callable[..., int]:
        """The Python function, for records with room for so many joints."""
        from ftqp.kernel.jit import carray, pointer  # numba, where the kernel is built

        module = import_module(self.module)
        words = {**vars(module), "carray": carray, "pointer": pointer, **NUMBERS}
        words["words"] = dtype("record", joints).itemsize // 8
        taken, records, arrays = [], [], []
        for argument, kind, shape in self.arguments():
            taken.append(f"{argument}_at" if kind not in ("", OBJECT) else argument)
            if shape:
                arrays.append(f"{argument} = carray(pointer({argument}_at), ({shape},), {kind})")
            elif kind in KINDS:
                words[f"_{kind}"] = dtype(kind, joints)
                records.append(f"{argument} = carray(pointer({argument}_at), 1, _{kind})[0]")
        formula = getattr(module, self.call.partition("(")[0])
        result = getattr(formula, "py_func", formula).__annotations__.get("return")
        body = [*records, *arrays]
        if self.first:
            body += [f"code = {self.first}", "if code < 0:", "    return code"]
        if result is None:
            body += [self.call, "return 0"]
        else:
            body.append(f"return 1 if {self.call} else 0" if result is bool else f"return {self.call}")
        text = "\n    ".join([f"def _entry({', '.join(taken)}):", *body])
        exec(compile(text, f"<entry point {name}>", "exec"), words)
        made: Callable[..., int] = words["_entry"]
        made.__name__ = made.__qualname__ = name
        return made
