"""The tab of ways out: a button that looks for them, and one for each that takes it."""

from collections.abc import Callable, Sequence
from typing import Any, final

from ftqp.sim.session.session_commands import Command, LookForWays, TakeWay
from ftqp.viz.live.frame import Ghost
from ftqp.viz.live.ghosts import colour_of, label_of, ways_table

LOOK, FORGET = "look", "forget"


@final
class WaysTab:
    """Controls for ways out.

    Args:
        gui: viser's controls, within the tab.
        put: Takes the commands, from any thread.
    """

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
        self._folder.visible = any(ghost.way.clear for ghost in ghosts)
        with self._folder:
            for number, ghost in enumerate(ghosts):
                if ghost.way.clear:
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
