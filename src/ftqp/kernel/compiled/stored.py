"""The file of one compiled entry point: a line of JSON that says what it is, then the object file."""

import hashlib
import json
from typing import Any

FORMAT = 1
"""The number of this file format; another one is compiled anew."""

_MAGIC = b"ftqp compiled kernel\n"
_LONGEST_HEADER = 65_536


def packed(facts: dict[str, Any], code: bytes) -> bytes:
    """The file's content.

    Args:
        facts: what the code was made from and for; compared with what is wanted when it is read.
        code: the object file.
    """
    header = {"format": FORMAT, **facts, **_marks(code)}
    return _MAGIC + json.dumps(header, sort_keys=True).encode() + b"\n" + code


def unpacked(content: bytes, wanted: dict[str, Any]) -> bytes | None:
    """The object file in it, if the file is whole and was made from and for what is wanted; else ``None``."""
    header, code = _parted(content)
    return code if header == {"format": FORMAT, **wanted, **_marks(code)} else None


def is_whole(content: bytes) -> bool:
    """Whether a file is as it was written, for whatever its code was made."""
    header, code = _parted(content)
    return header is not None and {**header, **_marks(code)} == header


def _marks(code: bytes) -> dict[str, Any]:
    """What shows that nothing of the code is missing or changed."""
    return {"size": len(code), "sha256": hashlib.sha256(code).hexdigest()}


def _parted(content: bytes) -> tuple[dict[str, Any] | None, bytes]:
    """The header, ``None`` where there is none, and what follows it."""
    if not content.startswith(_MAGIC):
        return None, b""
    end = content.find(b"\n", len(_MAGIC), len(_MAGIC) + _LONGEST_HEADER)
    if end < 0:
        return None, b""
    try:
        header = json.loads(content[len(_MAGIC) : end])
    except (ValueError, RecursionError):
        return None, b""
    return (header if isinstance(header, dict) else None), content[end + 1 :]
