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
    header = {"format": FORMAT, **facts, "size": len(code), "sha256": hashlib.sha256(code).hexdigest()}
    return _MAGIC + json.dumps(header, sort_keys=True).encode() + b"\n" + code


def unpacked(content: bytes, wanted: dict[str, Any]) -> bytes | None:
    """The object file in it, if the file is whole and was made from and for what is wanted; else ``None``."""
    if not content.startswith(_MAGIC):
        return None
    end = content.find(b"\n", len(_MAGIC), len(_MAGIC) + _LONGEST_HEADER)
    if end < 0:
        return None
    try:
        header = json.loads(content[len(_MAGIC) : end])
    except (ValueError, RecursionError):
        return None
    code = content[end + 1 :]
    found = {"format": FORMAT, **wanted, "size": len(code), "sha256": hashlib.sha256(code).hexdigest()}
    return code if header == found else None
