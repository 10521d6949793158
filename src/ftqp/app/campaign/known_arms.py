"""The arms of a campaign: each is read once in a process, however many episodes have it."""

from pathlib import Path
from typing import Any, final

from ftqp.app.scenario import composition
from ftqp.app.schema.robot_section import RobotTable
from ftqp.model.robot import Robot

MOST = 256
"""So many arms are kept; a campaign that draws payloads or limits has another one in every episode."""


@final
class KnownArms:
    """Makes the arms of ``[robot]`` tables, and keeps them: arms do not change.

    A copy that goes to another process begins without any.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[str, Path], Robot] = {}

    def __call__(self, table: RobotTable, folder: Path) -> Robot:
        """The arm of a table; files are relative to ``folder``."""
        key = repr(table), folder
        if key not in self._known:
            while len(self._known) >= MOST:
                del self._known[next(iter(self._known))]
            self._known[key] = composition.robot(table, folder)
        return self._known[key]

    def __reduce__(self) -> tuple[Any, ...]:
        return KnownArms, ()
