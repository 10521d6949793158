"""The server behind a page: the only file that imports viser."""

import asyncio
import errno
import logging
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from functools import partial
from http import HTTPStatus
from io import StringIO
from pathlib import Path
from threading import Lock
from typing import Any

from ftqp.core.errors import FtqpError, InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.viz.live.heard import is_taken
from ftqp.viz.live.page_access import Gate

try:
    import msgspec
    import viser
    import websockets.asyncio.server as sockets
    import zstandard
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
PATIENCE = 100
"""Messages of a browser that are dropped without a word, before its connection is closed."""
GONE = 1008
"""What a connection is closed with that says what no page says."""
HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""With every page: no other site shows it in a frame, and its address goes nowhere."""

_LOG = logging.getLogger("ftqp")
_OPENING = Lock()
_Control = Callable[[str], Any]


def open_server(host: str = LOOPBACK, port: int = 8080, label: str = "ftqp", gate: Gate | None = None) -> Any:
    """A server of pages, already listening.

    Any other ``host`` than that of this machine opens the page to the network. A ``port`` of 0 is any free
    one; where it is in use, the next free one is taken. Without a ``gate`` nobody is answered, as nobody
    knows the address.

    Raises:
        InputError: The address is none of this machine, or no port is free.
        FtqpError: This version of viser cannot be guarded.
    """
    # A browser that opens a connection and drops it is no error; websockets prints a traceback for it.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    known: list[_Control] = []
    with _silent(), _guarded(Gate(host) if gate is None else gate, known) as guarded:
        server = viser.ViserServer(host=host, port=free_port(host, port), label=label, verbose=False)
        if not guarded:
            server.stop()
            raise FtqpError(
                f"viser {VERSION} opens its server in another way than ftqp knows, so that nobody would "
                'check who connects; install one that it knows: pip install "viser==1.1.*"'
            )
    known.append(partial(_control, server))
    loop = server._event_loop
    loop.call_soon_threadsafe(loop.set_exception_handler, _Once())
    server.scene.world_axes.visible = False
    _keep_private(server)
    return server


def close_server(server: Any) -> None:
    """End a server and its threads; what it says about that is left out."""
    with _silent():
        server.stop()


def first_messages(server: Any) -> tuple[list[dict[str, Any]], list[bytes]]:
    """What a browser is told when it connects, scene and controls as they are now, and the arrays in it."""
    buffer, arrays = server._websock_server._broadcast_buffer, list[memoryview]()
    with buffer.buffer_lock:
        messages = list(buffer.message_from_id.values())
    told = [message.as_serializable_dict(arrays) for message in messages]
    return told, [bytes(array) for array in arrays]


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


def _control(server: Any, uuid: str) -> Any:
    """The state of a control, None where there is none, or none that can be used."""
    handle = server.gui._gui_input_handle_from_uuid.get(uuid)
    if handle is None or handle._impl.removed or getattr(handle._impl.props, "disabled", False):
        return None
    return handle._impl


@contextmanager
def _guarded(gate: Gate, known: list[_Control]) -> Iterator[list[bool]]:
    """While entered, servers are opened with a guard; yields a list that is no longer empty once one was.

    viser has no way to look at requests, nor at messages before it obeys them, but websockets has both.

    The last one ``known`` finds a control by its identity; without one there is none yet.
    """

    class Connection(sockets.ServerConnection):
        """A connection that gives viser only what a page says."""

        dropped = 0

        async def recv(self, decode: bool | None = None) -> Any:
            while True:
                data = await super().recv(decode)
                if isinstance(data, bytes) and is_taken(_message(data), len(data), find):
                    return data
                self.dropped += 1
                if self.dropped > PATIENCE:
                    await self.close(GONE, "that is nothing that a page of ftqp says")

    def find(uuid: str) -> Any:
        return known[-1](uuid) if known else None

    def serve(handler: Any, *place: Any, process_request: Any, **options: Any) -> Any:
        guarded.append(True)
        options |= {
            "process_request": partial(_admit, gate, process_request),
            "create_connection": Connection,
        }
        return opened(handler, *place, **options)

    guarded: list[bool] = []
    with _OPENING:
        opened = sockets.serve
        sockets.serve = serve  # type: ignore[assignment, misc]
        try:
            yield guarded
        finally:
            sockets.serve = opened  # type: ignore[misc]


def _admit(gate: Gate, answer: Any, connection: Any, request: Any) -> Any:
    """The response to a request for a page or, where it is refused, for a connection; else None."""
    headers = request.headers
    problem = gate.refusal(request.path, headers.get_all("Host"), headers.get_all("Origin"))
    if not problem and headers.get_all("Upgrade") and not _speaks_as_we(headers.get_all(_PROTOCOL)):
        problem = f"This is no page of viser {VERSION}; load it anew."
    if problem:
        return connection.respond(HTTPStatus.FORBIDDEN, problem + "\n")
    response = answer(connection, replace(request, path=gate.behind(request.path)))
    if response is not None:
        for name, value in HEADERS.items():
            response.headers[name] = value
    return response


_PROTOCOL = "Sec-WebSocket-Protocol"


def _speaks_as_we(offered: list[str]) -> bool:
    """Whether the page is of our version of viser, which would print a line for every other one."""
    versions = [one.strip() for one in ",".join(offered).split(",") if one.strip().startswith("viser-v")]
    return versions[:1] == [f"viser-v{VERSION}"]


def _message(data: bytes) -> Any:
    """What a message says; None where it is none."""
    try:
        return msgspec.msgpack.decode(data)
    except (msgspec.MsgspecError, ValueError, TypeError, RecursionError):
        return None


class _Once:
    """Logs the first error of a server's loop in a line, and none after it: nobody fills a terminal."""

    def __init__(self) -> None:
        self._said = False

    def __call__(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        if not self._said:
            self._said = True
            error = context.get("exception")
            _LOG.warning("the live page met an error, and goes on: %.300r", error or context.get("message"))


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


def unpacked(data: bytes) -> dict[str, Any]:
    """What viser's serializer has packed: eight bytes of length and zstd, in it eight bytes and msgpack."""
    inner = zstandard.ZstdDecompressor().decompress(
        data[8:], max_output_size=int.from_bytes(data[:8], "little")
    )
    length = int.from_bytes(inner[:8], "little")
    content: dict[str, Any] = msgspec.msgpack.decode(inner[8 : 8 + length])
    return content
