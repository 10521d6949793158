"""Ways out on a page: a ghost of the arm at the end of each, the tip's way there, and what takes it."""

from collections.abc import Callable, Sequence
from html import escape
from typing import Any, final

import numpy as np

from ftqp.sim.session.frame import Ghost
from ftqp.sim.session.session_commands import Command, LookForWays, TakeWay
from ftqp.viz.live import colours

LOOK, FORGET = "look", "forget"


@final
class WaysTab:
    """Controls for ways out, within the tab that is open; ``put`` takes the commands, from any thread."""

    def __init__(self, gui: Any, put: Callable[[Command], None]) -> None:
        self._gui, self._put = gui, put
        asked = {LOOK: LookForWays(), FORGET: LookForWays(False)}
        buttons = gui.add_button_group("ways out", tuple(asked))

        async def clicked(event: Any) -> None:
            put(asked[str(event.target.value)])

        buttons.on_click(clicked)
        self._folder = gui.add_folder("Take one")
        self._takes: list[Any] = []
        self._said = gui.add_html(ways_table(()))
        self._folder.visible = False
        self._shown: Sequence[Ghost] = ()

    def show(self, ghosts: Sequence[Ghost]) -> None:
        """A button for each way that is clear, where they are others than before."""
        if ghosts is self._shown:
            return
        self._shown = ghosts
        for button in self._takes:
            button.remove()
        self._takes.clear()
        self._said.content = ways_table(ghosts)
        self._folder.visible = any(ghost.clear for ghost in ghosts)
        with self._folder:
            for number, ghost in enumerate(ghosts):
                if ghost.clear:
                    self._add(number, label_of(number, ghost))

    def take(self, number: int) -> None:
        """Go a way, from 0, as somebody has clicked its button or its ghost."""
        self._put(TakeWay(number))

    def _add(self, number: int, words: str) -> None:
        """A button that takes a way, in the colour of its ghost."""
        button = self._gui.add_button(words, color=colour_of(number))

        async def clicked(_event: Any) -> None:
            self.take(number)

        button.on_click(clicked)
        self._takes.append(button)


_FONT = "font:12px/1.4 system-ui,sans-serif;color:#444"
SHADE = 0.3
"""Opacity of a ghost."""
PULL = 0.12
"""The label of a ghost is so far above its tip, as a share of the arm's size; those of one tip one above the
other. A thread leads from the tip to it."""
THREAD = 0.003
"""How thick that is, as a share of the arm's size: half of the tip's way."""


@final
class GhostNodes:
    """The nodes of the ways out of one scene, made anew whenever others are found; ``draw`` draws an arm."""

    def __init__(
        self,
        server: Any,
        name: str,
        size: float,
        draw: Callable[[str, Ghost, colours.Colour, float], list[Any]],
    ) -> None:
        self._server, self._name, self._size, self._draw = server, name, size, draw
        self._shown: Sequence[Ghost] = ()
        self._root: Any = None
        self.taken: Callable[[int], None] = lambda number: None

    def show(self, ghosts: Sequence[Ghost]) -> None:
        """Draw the ways that are clear, where they are others than before."""
        if ghosts is self._shown:
            return
        self._shown = ghosts
        if self._root is not None:
            self._root.remove()
            self._root = None
        if not ghosts:
            return
        root = f"{self._name}/ways"
        self._root = self._server.scene.add_frame(root, show_axes=False)
        tips: list[Any] = []
        for number, ghost in enumerate(ghosts):
            if ghost.clear:
                self._add(f"{root}/{number}", number, ghost, tips)

    def _add(self, name: str, number: int, ghost: Ghost, tips: list[Any]) -> None:
        """One way; labels of ends that are near each other are put one above the other."""
        colour = colour_of(number)
        self._server.scene.add_frame(name, show_axes=False)
        if len(ghost.tips) > 1:
            pieces = np.stack([ghost.tips[:-1], ghost.tips[1:]], axis=1)
            self._server.scene.add_line_segments(f"{name}/tip", pieces, colour, thickness=0.006 * self._size)

        async def clicked(_event: Any) -> None:
            self.taken(number)

        for mesh in self._draw(name, ghost, colour, SHADE):
            mesh.on_click(clicked)
        end = ghost.tips[-1]
        above = 1 + sum(float(abs(end - other).max()) < PULL * self._size for other in tips)
        tips.append(end)
        place = (float(end[0]), float(end[1]), float(end[2]) + above * PULL * self._size)
        thread = np.array([[end, place]], dtype=np.float32)
        self._server.scene.add_line_segments(f"{name}/thread", thread, colour, thickness=THREAD * self._size)
        self._server.scene.add_label(
            f"{name}/said", label_of(number, ghost), position=place, anchor="bottom-center"
        )


def colour_of(number: int) -> colours.Colour:
    """The colour of a way: of its ghost, the thread to its label, its button and its line in the table."""
    return colours.WAYS[number % len(colours.WAYS)]


def label_of(number: int, ghost: Ghost) -> str:
    """What a way is, and what it takes."""
    return f"{number + 1} {ghost.kind}: {ghost.price}"


def ways_table(ghosts: Sequence[Ghost]) -> str:
    """All ways in words, those that are not clear, too."""
    rows = "".join(
        f'<div style="color:{_shade(number, ghost)};margin-bottom:4px"><b>{number + 1}</b> '
        f"{escape(ghost.sentence)}</div>"
        for number, ghost in enumerate(ghosts)
    )
    said = (
        rows
        or "Where a task cannot go on: <b>look</b> finds where the arm can go from here, and what it takes."
    )
    return f'<div id="ftqp-ways" style="{_FONT};padding:2px 10px">{said}</div>'


def _shade(number: int, ghost: Ghost) -> str:
    """The colour of a way's line in the table."""
    return colours.hexadecimal(colour_of(number)) if ghost.clear else "#999"
