"""Keeps the frames that a page has shown, for a recording."""

from typing import Final, final

from ftqp.model.robot import Robot
from ftqp.sim.session.session_commands import Command
from ftqp.viz.live.frame import Frame
from ftqp.viz.live.frame_source import Source, Stage

MOST: Final = 1800
"""Frames that are kept at most, one minute of 30 a second; every other one goes when they are reached."""


@final
class FrameKeeper:
    """A source that keeps what it shows: a whole session, thinned to a minute of pictures at most.

    When the arm is replaced by another one, or begins anew, the recording begins anew, too.

    Attributes:
        frames: What has been kept, in its command.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.frames: list[Frame] = []
        self._every, self._seen = 1, 0

    @property
    def robot(self) -> Robot:
        """The arm of the kept frames."""
        return self._source.stage().robot

    def frame(self) -> Frame:
        """The latest frame of the source; it is kept if its tick is a later one."""
        frame = self._source.frame()
        kept = self.frames
        if kept and (frame.stage != kept[-1].stage or frame.tick < kept[-1].tick):
            kept.clear()
            self._every, self._seen = 1, 0
        if not kept or frame.tick > kept[-1].tick:
            if self._seen % self._every == 0:
                kept.append(frame)
            self._seen += 1
        if len(kept) >= MOST:
            del kept[1::2]
            self._every *= 2
        return frame

    def stage(self) -> Stage:
        """The stage of the source."""
        return self._source.stage()

    def put(self, command: Command) -> None:
        """Hand an command on."""
        self._source.put(command)
