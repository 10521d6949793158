"""The symbols of an object file: what it offers and what it needs from the process."""

import struct
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Symbols:
    """Names in an object file.

    Attributes:
        defined: what others can call.
        needed: what the process has to provide.
    """

    defined: frozenset[str]
    needed: frozenset[str]


def symbols_of(code: bytes) -> Symbols | None:
    """The symbols of a 64-bit little-endian ELF object; ``None`` for any other format.

    Raises:
        ValueError: if it begins like one but is broken.
    """
    if code[:6] != b"\x7fELF\x02\x01":
        return None
    try:
        return _elf_symbols(code)
    except (struct.error, UnicodeDecodeError, IndexError) as error:
        raise ValueError(f"the object file is broken: {error}") from None


def _elf_symbols(code: bytes) -> Symbols:
    (sections_at,) = struct.unpack_from("<Q", code, 0x28)
    size, count = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", code, sections_at + k * size) for k in range(count)]
    defined: set[str] = set()
    needed: set[str] = set()
    for section in sections:
        if section[1] != 2:  # SHT_SYMTAB
            continue
        at, length, names_in = section[4], section[5], section[6]
        names_at = sections[names_in][4]
        for entry in range(at + 24, at + length, 24):  # the first one is empty
            name, info, _, where = struct.unpack_from("<IBBH", code, entry)
            if info >> 4 == 0:  # STB_LOCAL
                continue
            end = code.index(b"\0", names_at + name)
            text = code[names_at + name : end].decode()
            if text:
                (needed if where == 0 else defined).add(text)
    return Symbols(defined=frozenset(defined), needed=frozenset(needed))
