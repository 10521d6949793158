"""An entry point of the kernel: where its Python function is made, who calls it, and with what."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class EntryPoint:
    """One way into the kernel.

    Attributes:
        name: unique, a Python identifier.
        module: the module with its formulas; imported only to compile it or to run it as plain Python.
        factory: the name of a function there that takes a capacity (joints that a record has room for) and
            returns the Python function, with int arguments and an int result.
        signature: a letter an argument: ``i`` an integer (an address, a count), ``o`` a Python object,
            which compiled code gets as its address and plain Python as itself.
        nogil: whether other Python threads run while it does; it must not touch a Python object then.
        caller: ``python``, or ``c``: then it is a function of int64_t that returns one.
    """

    name: str
    module: str
    factory: str
    signature: str
    nogil: bool = False
    caller: str = "python"

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or not self.name.isascii():
            raise ValueError(f"name is {self.name!r}, expected a Python identifier")
        if set(self.signature) - set("io"):
            raise ValueError(f"signature of {self.name} is {self.signature!r}, expected letters i and o only")
        if self.caller != "python" and "o" in self.signature:
            raise ValueError(f"{self.name} is called by {self.caller}, so it takes no Python object")
        if self.nogil and "o" in self.signature:
            raise ValueError(f"{self.name} releases the interpreter, so it takes no Python object")

    def function(self, capacity: int) -> Callable[..., int]:
        """The Python function with its formulas, for records of that capacity."""
        factory: Callable[[int], Callable[..., int]] = getattr(
            importlib.import_module(self.module), self.factory
        )
        return factory(capacity)

    def symbol(self, capacity: int) -> str:
        """Its name in object files, for records of that capacity."""
        return f"ftqp_{'' if self.caller == 'python' else 'c_'}{self.name}_{capacity}"
