"""The story for a newcomer, in parts: a brake, a box in the way, a goal that needs another way."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ftqp.app.demo.box_story import box_story
from ftqp.app.demo.brake_story import brake_story
from ftqp.app.demo.goal_story import goal_story
from ftqp.app.demo.story_part import StoryPart
from ftqp.app.output.console import ExitCode, tell, tell_json
from ftqp.app.run import runs
from ftqp.core.errors import InputError

PARTS: Final[Mapping[str, Callable[[Path], StoryPart]]] = {
    "brake": brake_story,
    "box": box_story,
    "goal": goal_story,
}
"""By what is asked for, in the order in which they are told; the first one's folder is that of the demo, and
each other one's lies in it."""


def tell_story(parts: Sequence[str], out: Path | None, *, as_json: bool) -> ExitCode:
    """Plays parts of the story, all of them where none is named, and tells each as soon as it has ended."""
    unknown = [name for name in parts if name not in PARTS]
    if unknown:
        raise InputError(f"{unknown[0]!r} is no part of the demo; it has {', '.join(PARTS)}")
    chosen = [name for name in PARTS if name in parts or not parts]
    folder, facts, code = runs.free_folder(out, "demo"), dict[str, Any](), ExitCode.DONE
    for name in chosen:
        played = PARTS[name](folder if name == next(iter(PARTS)) else folder / name)
        facts |= played.facts
        code = max(code, ExitCode(played.exit_code))
        if not as_json:
            tell("\n".join([*played.lines, ""] if played.whole else played.lines))
        if not played.whole:
            return _ended(code, facts, as_json)
    if not as_json and chosen[-1] == list(PARTS)[-1]:
        tell("The live page, where you break the joints: ftqp view")
    return _ended(code, facts, as_json)


def _ended(code: ExitCode, facts: Mapping[str, Any], as_json: bool) -> ExitCode:
    """The end, for a program in one object."""
    if as_json:
        tell_json(facts)
    return code
