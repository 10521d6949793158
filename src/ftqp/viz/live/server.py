"""The server behind a page, and recordings of one that need none: the only file that imports viser."""

import logging
import socket
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import FtqpError, InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.session.frame import Frame, frames_of
from ftqp.viz.live.colours import legend
from ftqp.viz.live.meshes import Part
from ftqp.viz.live.scene import Scene
from ftqp.viz.pages.page import inner_page

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


def open_server(host: str = LOOPBACK, port: int = 8080) -> Any:
    """A server of pages, already listening."""
    # A browser that opens a connection and drops it is no error; websockets prints a traceback for it.
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    _refuse_address(host, port)
    with _silent():
        server = viser.ViserServer(host=host, port=port, label="ftqp", verbose=False)
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


def _refuse_address(host: str, port: int) -> None:
    """Refuse where nobody can listen; of a port in use viser takes the next free one."""
    if not 0 <= port <= HIGHEST_PORT:
        raise InputError(f"port is {port}, expected 0 to {HIGHEST_PORT}; 0 takes any free one")
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        socket.create_server((host, 0), family=family).close()
    except OSError as error:
        raise InputError(
            f"cannot listen at {host!r} ({error.strerror}); --host {LOOPBACK} serves this machine only"
        ) from error


@contextmanager
def _silent() -> Iterator[None]:
    """Without viser's lines on standard output, where ``--json`` prints one object and nothing else."""
    with redirect_stdout(StringIO()):
        yield


LONGEST = 60.0
"""Seconds of pictures that a recording has at most, unless all are asked for."""
RATES = (30.0, 10.0, 4.0)
"""Pictures a second; the next smaller one is taken where a replay is too large."""
WAY = 240
"""The path is drawn by so many points."""


def picture_ticks(t: FloatArray, fps: float = 30.0, longest: float | None = LONGEST) -> IntArray:
    """The rows of a log that make up a recording."""
    if len(t) == 0:
        raise InputError("a log without rows has no pictures; expected one row or more")
    if not fps > 0.0:
        raise InputError(f"fps is {fps:g}, expected pictures a second, > 0")
    span = float(t[-1] - t[0])
    count = int(np.floor(span * fps + 1e-9)) + 1
    if longest is not None:
        count = min(count, max(2, int(longest * fps)))
    wanted = t[0] + (np.linspace(0.0, span, count) if count > 1 else np.zeros(1))
    return np.unique(np.append(np.clip(np.searchsorted(t, wanted - 1e-9), 0, len(t) - 1), len(t) - 1))


def recording(
    frames: Iterable[Frame],
    robot: Robot,
    *,
    path: FloatArray | None = None,
    title: str = "",
    parts: Sequence[Part] | None = None,
) -> str:
    """A whole page that plays the frames, each for as long as the times of the frames say."""
    coming = iter(frames)
    first = next(coming, None)
    if first is None:
        raise InputError("a recording needs at least one frame, got none")
    server = open_server(port=0)
    try:
        server.scene.configure_default_lights(True, cast_shadow=False)
        scene = Scene(server, robot, first, path=path, parts=parts, clock=True)
        tape = server.get_scene_serializer()
        t = first.t
        for frame in coming:
            tape.insert_sleep(max(frame.t - t, 0.0))
            t = max(frame.t, t)
            scene.show(frame)
        page = str(tape.as_html())
    finally:
        close_server(server)
    head = (
        f"<title>{escape(title or robot.name)}</title>"
        f'<meta name="generator" content="ftqp, viser {escape(VERSION, quote=True)}">'
    )
    said = legend(further=bool(first.further))
    shown = f'<div style="position:fixed;left:12px;bottom:48px;z-index:10">{said}</div>'
    return _inserted(_inserted(page, "</head>", head), "</body>", shown)


def replay(log: Log, robot: Robot, title: str, room: int, full: bool = False) -> str:
    """A page within the page that plays the run."""
    t = log["t"]
    path = None if "base.x" in log else log["target"][:: max(1, len(log) // WAY), :3]
    for rate in RATES:
        ticks = picture_ticks(t, rate, *((None,) if full else ()))
        frames = frames_of(log, robot, (int(k) for k in ticks))
        part = inner_page(recording(frames, robot, path=path, title=title), title)
        if len(part.encode()) <= room:
            return part
    raise FtqpError(
        f"the replay of {title} takes {len(part) / 1e6:.1f} MB and {max(room, 0) / 1e6:.1f} MB are left; "
        "make a report of this run alone, or see `ftqp view`"
    )


def _inserted(page: str, mark: str, text: str) -> str:
    """A page with a text before the last of some marks."""
    at = page.rindex(mark)
    return page[:at] + text + page[at:]
