"""What a recording holds, read as viser's client reads it."""

from base64 import b64decode

import msgspec
import numpy as np
import zstandard

MARK = '__VISER_EMBED_DATA__="'


def messages_of(page):
    """Length [s] and messages of a recording, each with its time [s]."""
    start = page.index(MARK) + len(MARK)
    data = b64decode(page[start : page.index('"', start)])
    room = int.from_bytes(data[:8], "little")
    inner = zstandard.ZstdDecompressor().decompress(data[8:], max_output_size=room)
    content = msgspec.msgpack.decode(inner[8 : 8 + int.from_bytes(inner[:8], "little")])
    return content["durationSeconds"], content["messages"]


def turns_of(page, node):
    """When a node of a recording turned and to where: times [s], quaternions w, x, y, z (k, 4)."""
    turns = [
        (t, m["wxyz"])
        for t, m in messages_of(page)[1]
        if m["type"] == "SetOrientationMessage" and m["name"] == node
    ]
    return np.array([t for t, _ in turns]), np.array([wxyz for _, wxyz in turns]).reshape(-1, 4)
