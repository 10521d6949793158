"""What ``ftqp view`` is asked to show: a scenario without end, a finished run, or a coverage report."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as File
from typing import Final, final

from ftqp.app.campaign.kept_campaign import STUDY
from ftqp.app.view.arms_of_scenario import arms_of
from ftqp.app.view.live_source import LiveSource
from ftqp.app.view.replay_source import ReplaySource
from ftqp.app.view.verdicts_file import VERDICTS, read_verdicts
from ftqp.core.errors import InputError
from ftqp.sim.log.log_file import OLD, load_log
from ftqp.sim.log.log_writer import FILE_NAME, log_files
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.live_session import FASTEST, Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Speed
from ftqp.viz.live.stage import Source

MOST: Final = 1800
"""Frames that are kept at most, one minute of 30 a second; every other one goes when they are reached."""


@final
class FrameKeeper:
    """Keeps what a page shows: a whole session, thinned to a minute of pictures at most.

    When the arm is replaced by another one, or begins anew, the recording begins anew, too.
    """

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self._every, self._seen = 1, 0

    def keep(self, frame: Frame) -> None:
        """Keep a frame if its tick is a later one."""
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


@contextmanager
def shown(choice: Choice, *, speed: float = 1.0, rival: bool = True) -> Iterator[tuple[str, Source]]:
    """The kind of what is shown, ``live``, ``replay`` or ``coverage``, and its source."""
    if not 0.0 < speed <= FASTEST:
        raise InputError(f"speed is {speed:g}, expected a factor above 0 and at most {FASTEST:g}")
    given = File(choice.scenario)
    folder = os.path.isdir(given)  # a name that is too long is none
    if folder and (given / VERDICTS).is_file():
        _alone(choice, "a coverage report")
        report = read_verdicts(given)
        session = Session(lambda wish: arms_of(wish, rival=rival), Choice(scenario=str(report.scenario)))
        session.put(Speed(speed))
        with LiveSource(session, report=report) as source:
            yield "coverage", source
    elif folder or given.name == FILE_NAME or given.suffix in (File(FILE_NAME).suffix, OLD):
        if folder and not log_files(given):
            if (given / STUDY).is_file():
                raise InputError(
                    f"folder {given} holds a campaign, of which `ftqp report {given}` tells; to view an "
                    "episode, run it by the campaign's command with --replay N, and name its folder"
                )
            raise InputError(
                f"folder {given} holds neither a run ({FILE_NAME}) nor a coverage report ({VERDICTS}); name "
                "a folder that ftqp run or ftqp coverage has made"
            )
        _alone(choice, "a finished run")
        log = load_log(given)
        replay = ReplaySource(log, f"{log.metadata.get('scenario', given.stem)}, a finished run")
        replay.put(Speed(speed))
        yield "replay", replay
    else:
        session = Session(lambda wish: arms_of(wish, rival=rival, faults=False), choice)
        session.put(Speed(speed))
        with LiveSource(session) as source:
            yield "live", source


def _alone(choice: Choice, what: str) -> None:
    """Refuse settings of scenarios for what has none."""
    named = {
        "--set": choice.overrides,
        "--scheme": choice.scheme,
        "--backend": choice.backend,
        "--plan": choice.plan,
    }
    given = [option for option, value in named.items() if value]
    if given:
        raise InputError(
            f"{', '.join(given)} is for scenarios, but {choice.scenario} is {what}; leave it out or view "
            "the scenario"
        )
