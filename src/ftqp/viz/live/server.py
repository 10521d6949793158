"""The server behind a page: the only file that imports viser."""

import errno
import logging
import socket
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from ftqp.core.errors import FtqpError, InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra

try:
    import viser
    from viser import _messages
except ImportError as error:
    raise MissingPackage("the live page", "viser", remedy_for_extra("viz")) from error

VERSION = str(viser.__version__)
"""Version of viser; recordings are read by the client of the same version, which is in them."""
LOOPBACK = "127.0.0.1"
"""The address that only this machine can reach."""
HIGHEST_PORT = 65535
TRIES = 100
"""Ports that are tried, from the one that was asked for."""


def open_server(host: str = LOOPBACK, port: int = 8080) -> Any:
    """A server of pages, already listening."""
    # A browser that opens a connection and drops it is no error; websockets prints a traceback for it.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    with _silent():
        server = viser.ViserServer(host=host, port=free_port(host, port), label="ftqp", verbose=False)
    server.scene.world_axes.visible = False
    _keep_private(server)
    return server


def close_server(server: Any) -> None:
    """End a server and its threads; what it says about that is left out."""
    with _silent():
        server.stop()


def first_messages(server: Any) -> tuple[list[dict[str, Any]], list[bytes]]:
    """What a browser gets when it connects, scene and controls as they are now, and the arrays in it."""
    buffer, arrays = server._websock_server._broadcast_buffer, list[memoryview]()
    with buffer.buffer_lock:
        messages = list(buffer.message_from_id.values())
    packed = [message.as_serializable_dict(arrays) for message in messages]
    return packed, [bytes(array) for array in arrays]


def client_page() -> str:
    """The page of viser's client, one file without an address in it."""
    file = Path(viser.__file__).parent / "client" / "build" / "index.html"
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise FtqpError(f"viser {VERSION} has its page elsewhere than ftqp knows: {error}") from error


def _keep_private(server: Any) -> None:
    """Let no browser ask for a public address: viser would open a tunnel through a server of others."""
    for request in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(request)


def free_port(host: str, port: int) -> int:
    """The first free port from ``port`` on, or 0 for 0."""
    if not 0 <= port <= HIGHEST_PORT:
        raise InputError(f"port is {port}, expected 0 to {HIGHEST_PORT}; 0 takes any free one")
    last = min(port + TRIES, HIGHEST_PORT + 1)
    for candidate in range(port, last):
        try:
            families = socket.getaddrinfo(host, candidate, type=socket.SOCK_STREAM)
            with socket.socket(families[0][0], socket.SOCK_STREAM) as trial:
                trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                trial.bind(families[0][4])
            return candidate
        except OSError as error:
            reason = error
            if isinstance(error, socket.gaierror) or error.errno != errno.EADDRINUSE:
                break
    if isinstance(reason, socket.gaierror) or reason.errno != errno.EADDRINUSE:
        raise InputError(
            f"cannot listen at {host!r}, port {candidate} ({reason.strerror}); "
            f"--host {LOOPBACK} serves this machine only, and ports below 1024 may be reserved"
        )
    raise InputError(f"ports {port} to {last - 1} of {host} are all in use; give a free one with --port")


@contextmanager
def _silent() -> Iterator[None]:
    """Without viser's lines on standard output, where ``--json`` prints one object and nothing else."""
    with redirect_stdout(StringIO()):
        yield
