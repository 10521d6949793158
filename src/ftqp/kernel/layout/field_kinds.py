"""How the fields of a room are written down: arrays of floats and of integers, and single numbers."""

from typing import Any

Fields = list[Any]
Shape = tuple[int, ...]


def floats(arrays: dict[str, Shape]) -> Fields:
    """Arrays of ``f8``, each with its shape."""
    return [(name, "f8", shape) for name, shape in arrays.items()]


def integers(arrays: dict[str, Shape]) -> Fields:
    """Arrays of ``i8``, each with its shape."""
    return [(name, "i8", shape) for name, shape in arrays.items()]


def scalars(kind: str, names: str) -> Fields:
    """Single numbers of one kind, their names separated by spaces."""
    return [(name, kind) for name in names.split()]
