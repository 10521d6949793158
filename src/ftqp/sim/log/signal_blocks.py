"""Blocks of rows whose columns are found by name, as those of a log are."""

from collections.abc import Sequence
from typing import Any, Protocol, final

from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.sim.log.signals import Column


class Signals(Protocol):
    """The role of rows whose columns have names: a log, or a block of one."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """One signal, (K,), or all whose names begin with ``name`` and a dot, (K, count)."""

    def __contains__(self, name: object) -> bool:
        """Whether there is a single signal of this name."""

    def __len__(self) -> int:
        """Rows."""


@final
class Places:
    """Where the signals of a row lie."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self.single = {column.name: place for place, column in enumerate(columns)}
        self.groups: dict[str, Any] = {}
        for name, place in self.single.items():
            self.groups.setdefault(name.split(".", 1)[0], []).append(place)
        for group, places in self.groups.items():
            if places == list(range(places[0], places[-1] + 1)):
                self.groups[group] = slice(places[0], places[-1] + 1)


@final
class SignalBlock:
    """A block of rows by name."""

    def __init__(self, places: Places, rows: FloatArray) -> None:
        self._places, self._rows = places, rows

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, name: object) -> bool:
        return name in self._places.single

    def __getitem__(self, name: str) -> NDArray[Any]:
        place = self._places.single.get(name)
        return self._rows[:, self._places.groups[name] if place is None else place]
