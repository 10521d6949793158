"""Which files of the kernel write which fields of a planner's record, as its source says.

A room that is handed on under another name, as solvers are handed ``qp``, is not followed.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from ftqp.kernel.layout.rooms import ROOMS

KERNEL = Path(__file__).resolve().parents[2] / "src/ftqp/kernel"
OTHER_RECORDS = ("study", "continuation", "detection", "building", "compiled", "layout")
"""Folders whose functions are handed a record of another kind, or none."""
BETWEEN_TICKS = ("told",)
"""Folders with what writes into a record between its ticks, when a planner is told something."""
FIELDS = {room: {field[0] for field in fields(8)} for room, fields in ROOMS.items()}
PUTS = {"put": {0}, "put_either": {0}}
"""Which arguments functions write that are no source of their own."""

Field = tuple[str, str]


def sources() -> dict[str, ast.Module]:
    """The syntax trees of the kernel's files that are handed a planner's record, by their place in it."""
    return {
        path.relative_to(KERNEL).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(KERNEL.rglob("*.py"))
        if path.relative_to(KERNEL).parts[0] not in OTHER_RECORDS + BETWEEN_TICKS
    }


def field_of(node: ast.expr) -> Field | None:
    """The room and the field that an expression is, or is an entry of: K.room.field[i], room.field."""
    while isinstance(node, ast.Subscript):
        node = node.value
    if not isinstance(node, ast.Attribute):
        return None
    owner = node.value
    room = owner.attr if isinstance(owner, ast.Attribute) else getattr(owner, "id", "")
    return (room, node.attr) if node.attr in FIELDS.get(room, ()) else None


def _pairs(node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr | None]]:
    """Each target of an assignment, with its value where that stands beside it."""
    for target in node.targets:
        if isinstance(target, ast.Tuple):
            values = node.value.elts if isinstance(node.value, ast.Tuple) else [None] * len(target.elts)
            yield from zip(target.elts, values, strict=True)
        else:
            yield target, node.value


class Function:
    """What one function writes: fields, and arguments of its own."""

    def __init__(self, node: ast.FunctionDef) -> None:
        self.arguments = [a.arg for a in node.args.args]
        self.calls = [n for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
        self.fields: set[Field] = set()
        self.written: set[int] = set()
        self._stands_for: dict[str, ast.expr] = {}
        assigned = [n for n in ast.walk(node) if isinstance(n, ast.Assign)]
        for one in assigned:
            for target, value in _pairs(one):
                if isinstance(target, ast.Name) and value is not None:
                    self._stands_for[target.id] = value
        for one in assigned:
            for target, _ in _pairs(one):
                self._write(target)
        for n in ast.walk(node):
            if isinstance(n, ast.AugAssign):
                self._write(n.target)

    def _write(self, target: ast.expr) -> None:
        if not isinstance(target, ast.Name):  # a name alone is a number of the function's own
            self.write(target)

    def write(self, target: ast.expr) -> bool:
        """Note that an array or a field is written: whether that is new."""
        before = len(self.fields) + len(self.written)
        found, node = field_of(target), target
        for _ in range(3):  # names that stand for names
            while isinstance(node, ast.Subscript):
                node = node.value
            if found is None and isinstance(node, ast.Name):
                if node.id in self.arguments:
                    self.written.add(self.arguments.index(node.id))
                    break
                node = self._stands_for.get(node.id, node)
                found = field_of(node)
        if found is not None:
            self.fields.add(found)
        return len(self.fields) + len(self.written) > before


def writers() -> dict[str, list[str]]:
    """By room.field, the files whose functions write it, those included that hand it to one that does."""
    functions: dict[str, list[Function]] = {}
    files: dict[str, list[Function]] = {}
    for name, tree in sources().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                function = Function(node)
                functions.setdefault(node.name, []).append(function)
                files.setdefault(name, []).append(function)
    again = True
    while again:
        again = False
        for every in functions.values():
            for function in every:
                for call in function.calls:
                    name = call.func.id  # type: ignore[attr-defined]
                    places = set(PUTS.get(name, ()))
                    for called in functions.get(name, ()):
                        places |= called.written
                    for place in places:
                        if place < len(call.args) and function.write(call.args[place]):
                            again = True
    found: dict[str, list[str]] = {}
    for name, every in files.items():
        for room, field in {field for function in every for field in function.fields}:
            found.setdefault(f"{room}.{field}", []).append(name)
    return {field: sorted(found[field]) for field in sorted(found)}
