"""Hashes of the kernel's source, by which it is told whether a library was built from it."""

import ast
import hashlib
from collections.abc import Callable
from pathlib import Path

BUILDER = "building"
"""The folder of what builds the kernel, which is no part of its source."""


def file_key(package: Path) -> str:
    """A hash of every source file of a package, in hexadecimal."""
    return _key(package, Path.read_bytes)


def code_key(package: Path) -> str:
    """A hash of a package's code, in hexadecimal: comments and docstrings do not change it."""
    return _key(package, lambda path: code_text(path).encode())


def code_text(path: Path) -> str:
    """The code of a source file without comments and docstrings; the text as it is where it is no Python."""
    text = path.read_text(encoding="utf-8")
    try:
        tree = ast.parse(text)
    except SyntaxError:
        return text
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [one for one in body if not _is_text(one)]  # type: ignore[attr-defined]
    return ast.unparse(tree)


def _is_text(node: ast.AST) -> bool:
    """Whether a statement is nothing but a text: a docstring, of a function or of a constant."""
    if not isinstance(node, ast.Expr):
        return False
    return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _key(package: Path, content_of: Callable[[Path], bytes]) -> str:
    digest = hashlib.sha256()
    for path in sorted((*package.rglob("*.py"), *package.rglob("*.c"))):
        if path.parent.name == BUILDER:
            continue
        content = content_of(path)
        digest.update(f"{path.relative_to(package).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()[:24]
