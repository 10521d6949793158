"""Structures as texts: a section a room, and in it a line ``names  type[shape]  meaning`` for its fields.

Lines are four spaces in, what goes on from the line before is further in. SI units; a unit of its own stands
in brackets. A shape may name N, the joints that there is room for, and what else whoever reads the text says.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Fields = list[Any]
"""Fields of a room: names, types and shapes, as numpy takes them."""
_FIELDS = re.compile(r"    (\w[\w ]*?) +([fi][48])(?:\[(\S+)\])?(?: +\S.*)?")


def sections(text: str, constants: Mapping[str, Any]) -> dict[str, Callable[..., Fields]]:
    """For every section of a text, whose shapes name constants, what gives its fields, by the joints."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for line in text.splitlines():
        if line and not line.startswith(" "):
            lines = found[line.split()[0]] = []
        elif line and not line.startswith(" " * 8):
            match = _FIELDS.fullmatch(line)
            if match is None:
                raise ValueError(f"{line!r} is no line of fields")
            lines.append((match[1], match[2], match[3] or ""))

    def fields_of(lines: list[tuple[str, str, str]]) -> Callable[..., Fields]:
        def fields(N: int = 0, **sizes: int) -> Fields:
            known = {**constants, "N": N, **sizes}
            return [
                (name, kind, eval(f"({shape},)", known)) if shape else (name, kind)  # constants and sizes
                for names, kind, shape in lines
                for name in names.split()
            ]

        return fields

    return {name: fields_of(lines) for name, lines in found.items()}


def structure(fields: Fields) -> np.dtype[Any]:
    """The type of a record or room of these fields, laid out as C does."""
    return np.dtype(fields, align=True)
