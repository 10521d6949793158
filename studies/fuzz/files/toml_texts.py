"""The text of a TOML file: tables written in any of the ways that TOML has, then spoiled as text."""

from datetime import date, time
from random import Random
from typing import Any

from ftqp.app.scenario.document import toml

LETTERS = "\0\x1b\x7f\ufeff\u202e\uff11\u00b2\u0661_=[]{}\"'.#,\n\r\t 1e9"


def text_of(content: dict[str, Any], rng: Random) -> bytes:
    """Tables as a file."""
    try:
        text = toml(content) if rng.random() < 0.5 else _written(content, rng)
    except (RecursionError, ValueError):
        text = "a = " + "[" * 100
    if rng.random() < 0.75:
        return text.encode("utf-8", "replace")
    return _spoiled(text, rng)


def _written(content: dict[str, Any], rng: Random) -> str:
    """Headers, dotted keys or inline tables, as they are drawn."""
    first, then = [], []
    for key, value in content.items():
        style = rng.randrange(3)
        if isinstance(value, dict) and style == 0:
            then.append(f"[{_key(key, rng)}]")
            then += [f"{_key(k, rng)} = {_value(v, rng)}" for k, v in value.items()]
        elif isinstance(value, dict) and style == 1 and value:
            first += [f"{_key(key, rng)}.{_key(k, rng)} = {_value(v, rng)}" for k, v in value.items()]
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value) and style:
            for item in value:
                then.append(f"[[{_key(key, rng)}]]")
                then += [f"{_key(k, rng)} = {_value(v, rng)}" for k, v in item.items()]
        else:
            first.append(f"{_key(key, rng)} = {_value(value, rng)}")
    return "\n".join([*first, *then]) + "\n"


def _key(key: str, rng: Random) -> str:
    bare = key.replace("_", "").replace("-", "").isalnum() and key.isascii()
    return key if bare and rng.random() < 0.9 else _quoted(key)


def _quoted(text: str) -> str:
    return '"' + "".join(c if c >= " " and c not in '"\\\x7f' else f"\\u{ord(c):04x}" for c in text) + '"'


def _value(value: Any, rng: Random) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k, rng)} = {_value(v, rng)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(v, rng) for v in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, int):
        return rng.choice((str(value), f"{value:_}", hex(value) if value >= 0 else str(value)))
    if isinstance(value, float):
        return rng.choice((repr(value), f"{value:+}"))
    text = str(value)
    return f"'{text}'" if text.isprintable() and "'" not in text and rng.random() < 0.3 else _quoted(text)


def _spoiled(text: str, rng: Random) -> bytes:
    """Lines and letters out of place, another encoding, or an end in the middle."""
    lines = text.splitlines()
    change = rng.randrange(9)
    if change == 0 and lines:
        del lines[rng.randrange(len(lines))]
    elif change == 1 and lines:
        lines.insert(rng.randrange(len(lines) + 1), rng.choice(lines))
    elif change == 2 and len(lines) > 1:
        k, m = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[k], lines[m] = lines[m], lines[k]
    elif change == 3:
        return text[: rng.randrange(len(text) + 1)].encode()
    elif change == 4:
        return text.encode(rng.choice(("utf-16", "utf-32", "utf-8-sig", "cp037")), "replace")
    elif change == 5:
        data = bytearray(text.encode())
        for _ in range(rng.randint(1, 4)):
            if data:
                data[rng.randrange(len(data))] = rng.randrange(256)
        return bytes(data)
    else:
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(text) + 1)
            text = text[:at] + rng.choice(LETTERS) + text[at + rng.randrange(2) :]
        return text.encode("utf-8", "surrogatepass")
    return "\n".join(lines).encode()
