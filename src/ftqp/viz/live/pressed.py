"""Buttons that look pressed: a style sheet, as viser's groups of buttons do not know which one counts."""

from collections.abc import Mapping, Sequence
from typing import Any, final

from ftqp.faults.kinds import KINDS
from ftqp.viz.live import colours
from ftqp.viz.live.frame import Frame

NARROW = (
    ".mantine-Flex-root>div:first-child:has(>p>label){width:5.4em!important}"
    ".mantine-Flex-root button.mantine-Button-root{padding:0 3px}"
)
"""Labels and buttons leave room for four buttons in a row of a narrow panel."""
BREAKS = {kind.number: place for place, kind in enumerate(KINDS.values())}
"""The place of a button in the row of a joint, by the code of the condition that it makes."""


@final
class PressedButtons:
    """The style sheet of one panel.

    Args:
        gui: viser's controls; the sheet is one of them, and shows nothing itself.
    """

    def __init__(self, gui: Any) -> None:
        self.sheet = gui.add_html(_sheet({}))
        self._rows: list[tuple[Any, int]] = []
        self._clock: Any = None
        self._shown: Mapping[tuple[str, int], str] = {}

    def watch_clock(self, buttons: Any) -> None:
        """The first of these is pressed while time stands."""
        self._clock = buttons

    def watch_joints(self, rows: Sequence[Any]) -> None:
        """In the row of each joint the button of its condition is pressed."""
        self._rows = list(zip(rows, range(len(rows)), strict=True))

    def show(self, frame: Frame) -> None:
        """Press what a frame says."""
        pressed = {}
        if self._clock is not None and frame.paused:
            pressed[uuid(self._clock), 0] = colours.hexadecimal(colours.CONDITION[0])
        for row, i in self._rows:
            code = int(frame.truth[i])
            if code in BREAKS:
                pressed[uuid(row), BREAKS[code]] = colours.hexadecimal(colours.CONDITION[code])
        if pressed != self._shown:
            self._shown = pressed
            self.sheet.content = _sheet(pressed)


def uuid(control: Any) -> str:
    """How a page knows a control: its label is for it."""
    return str(control._impl.uuid)


def _sheet(pressed: Mapping[tuple[str, int], str]) -> str:
    """The sheet of the buttons that are pressed."""
    rules = "".join(rule(name, str(place + 1), colour) for (name, place), colour in pressed.items())
    return sheet(rules)


def sheet(rules: str) -> str:
    """A sheet of rules as HTML."""
    return f'<style id="ftqp-pressed">{NARROW}{rules}</style>'


def rule(name: str, place: str, colour: str) -> str:
    """The rule that presses the button at a place, from 1 on, of the group that a page knows by a name."""
    return (
        f'.mantine-Flex-root:has(>div>p>label[for="{name}"]) button:nth-of-type({place})'
        f"{{background:{colour}!important;color:#fff!important;box-shadow:inset 0 2px 3px rgba(0,0,0,.4)}}"
    )
