"""``ftqp view``: the live page of a scenario, a finished run, or a coverage report."""

import json
import os
import signal
import sys
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from ipaddress import ip_address
from pathlib import Path
from threading import Event, current_thread, main_thread
from types import FrameType
from typing import TYPE_CHECKING, Final, final

from ftqp.app.output.console import ExitCode, say, tell, tell_text
from ftqp.app.run.runs import CAMPAIGN, write
from ftqp.app.view.live_source import LiveSource, arms_of
from ftqp.app.view.replay_source import ReplaySource
from ftqp.app.view.verdicts_file import VERDICTS, read_verdicts
from ftqp.core.errors import InputError, unknown
from ftqp.core.extras import remedy_for_extra
from ftqp.core.whole_file import free_path
from ftqp.model.robot import Robot
from ftqp.sim.log.log_file import OLD, load_log
from ftqp.sim.log.log_writer import FILE_NAME, log_files
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.live_session import FASTEST, Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Speed
from ftqp.viz.live.meshes import mesh_parts
from ftqp.viz.live.stage import Source, Stage

if TYPE_CHECKING:
    from ftqp.viz.live.meshes import Part

MOST: Final = 1800
"""Frames that are kept at most, one minute of 30 a second; every other one goes when they are reached."""


@final
class FrameKeeper:
    """Keeps what a page shows: a whole session, thinned to a minute of pictures at most."""

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
    given = Path(choice.scenario)
    folder = os.path.isdir(given)  # a name that is too long is none
    if folder and (given / VERDICTS).is_file():
        _alone(choice, "a coverage report")
        report = read_verdicts(given)
        session = Session(lambda wish: arms_of(wish, rival=rival), Choice(scenario=str(report.scenario)))
        session.put(Speed(speed))
        with LiveSource(session, report=report) as source:
            yield "coverage", source
    elif folder or given.name == FILE_NAME or given.suffix in (Path(FILE_NAME).suffix, OLD):
        if folder and not log_files(given):
            if (given / CAMPAIGN).is_file():
                raise InputError(
                    f"folder {given} holds a campaign, which `ftqp report {given}` shows; to view an "
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


MESHES: Final = ("collision", "visual", "none")
IN_PHYSICS, WITHOUT = "panda-unannounced", "panda-circle"
"""What is shown where nothing is named, with MuJoCo and without it."""
SLOWER = ("path.duration=8",)
"""A lap in which a person can click at an instant."""


def usual() -> tuple[str, tuple[str, ...]]:
    """What is shown where nothing is named: a scenario, and what is changed of it."""
    if find_spec("mujoco") is not None:
        return IN_PHYSICS, SLOWER
    say(f"note: without MuJoCo the arm follows its commands exactly; {remedy_for_extra('sim')} for physics")
    return WITHOUT, ()


def view(
    choice: Choice,
    *,
    host: str,
    port: int,
    speed: float,
    browser: bool,
    record: Path | None,
    rival: bool,
    meshes: str,
    as_json: bool,
) -> ExitCode:
    """Serve the page until Ctrl-C."""
    from ftqp.viz.live.live_page import Page

    if meshes not in MESHES:
        raise unknown("kind of meshes", meshes, "a page", MESHES)
    if record is not None:
        free_path(record, "recording")
    if not is_loopback(host):
        say(
            f"warning: the page is open to the network at {host}: anybody who reaches it can break joints of "
            "this simulation, and nothing is encrypted; leave --host out to keep it to this machine"
        )
    with _until_interrupted() as ended, shown(choice, speed=speed, rival=rival) as (kind, source):
        kept = FrameKeeper()

        def parts(robot: Robot) -> "Sequence[Part]":
            return mesh_parts(robot, source.stage().urdf, "chain" if meshes == "none" else meshes)

        with Page(source, host=host, port=port, parts=parts, seen=kept.keep) as page:
            try:
                if as_json:
                    facts = {"url": page.url, "port": page.port, "kind": kind, "title": source.stage().title}
                    tell_text(json.dumps(facts) + "\n")  # one line: the page is still up
                else:
                    tell(f"{source.stage().title}: {page.url}")
                    say("Ctrl-C ends it.")
                if browser:
                    _open(page.url)
                page.run(ended)
            finally:
                if record is not None:
                    _write(record, kept.frames, source.stage(), parts)
    return ExitCode.INTERRUPTED


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches the address."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


@contextmanager
def _until_interrupted() -> Iterator[Event]:
    """An event that Ctrl-C sets, in whatever code it comes; a second Ctrl-C interrupts at once."""
    ended = Event()
    if current_thread() is not main_thread():
        yield ended
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        if ended.is_set():
            raise KeyboardInterrupt
        ended.set()

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield ended
    finally:
        signal.signal(signal.SIGINT, before)


def _write(
    file: Path, frames: Sequence[Frame], stage: Stage, parts: "Callable[[Robot], Sequence[Part]]"
) -> None:
    """The recording of what was shown."""
    from ftqp.viz.live.server import recording

    if len(frames) < 2:
        say(f"note: nothing moved, so there is no recording {file}")
        return
    robot = stage.robot
    write(file, recording(frames, robot, path=stage.path, title=stage.title, parts=parts(robot)))
    say(f"recording: {file}")


def _open(url: str) -> None:
    """Open a browser where there is a screen; without one the address alone is printed."""
    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        return
    if not webbrowser.open(url):
        say("note: no browser could be opened; open the address by hand")
