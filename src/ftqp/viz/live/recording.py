"""A recording: frames as one HTML file that plays in any browser, without a network.

The file is viser's client, 819 KB, with the scene's messages in it; their format belongs to viser's version,
which is written into the file. The log of a run stays its record.
"""

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import FtqpError, InputError
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.session.frame import Frame, frames_of
from ftqp.viz.live.colours import legend
from ftqp.viz.live.meshes import Part
from ftqp.viz.live.scene import Scene
from ftqp.viz.live.server import VERSION, close_server, open_server
from ftqp.viz.pages.page import inner_page

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
