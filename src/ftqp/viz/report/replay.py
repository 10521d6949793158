"""The replay of a run within a report: the arm in space, with a slider over time."""

from typing import Final

from ftqp.core.errors import FtqpError
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.live.frame import frames_of
from ftqp.viz.live.recording import picture_ticks, recording
from ftqp.viz.pages.page import inner_page

RATES: Final = (30.0, 10.0, 4.0)
"""Pictures a second; the next smaller one is taken where a replay is too large."""
WAY: Final = 240
"""The path is drawn by so many points."""


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
