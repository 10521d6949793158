"""A block of a log's rows by group of signals, with the stamps that messages carry."""

from typing import Self, final

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.sim.log.log_rows import LogRows

NEEDED = ("t", "q", "v", "a", "status")
"""Groups that every run has."""
NANOSECONDS = 1_000_000_000
LATEST = 2**31 - 1
"""Seconds that a stamp can hold."""


@final
class Ticks:
    """Rows of a log, to be asked for groups of signals."""

    def __init__(self, rows: LogRows) -> None:
        self._rows = rows
        self._groups = rows.groups()
        missing = [name for name in NEEDED if name not in self._groups]
        if missing:
            raise InputError(
                f"{rows.title} has no signals {', '.join(missing)}, expected the log of a run; write "
                "CSV or NPZ"
            )
        if not rows.count:
            raise InputError(f"{rows.title} has no rows yet; expected a run of at least one tick")
        self.joints = tuple(self.names("q"))
        self.block = np.empty((0, len(rows.columns)))

    def of(self, block: FloatArray) -> Self:
        """The same, of other rows."""
        self.block = block
        t = self["t"][:, 0]
        if not ((t >= 0.0) & (t < LATEST)).all():
            raise InputError(
                f"{self._rows.title} has a time outside 0 to {LATEST} s, which no stamp can hold"
            )
        return self

    def __contains__(self, group: str) -> bool:
        return group in self._groups

    def __getitem__(self, group: str) -> FloatArray:
        """Signals of a group, (K, count)."""
        chosen: FloatArray = self.block[:, self._groups[group]]
        return chosen

    def names(self, group: str) -> list[str]:
        """What the signals of a group are of, in their order; none where there is no such group."""
        return [self._rows.columns[k].name.split(".", 1)[1] for k in self._groups.get(group, [])]

    def scalar(self, name: str) -> FloatArray:
        """A signal, (K, 1); NaN where an older log has none."""
        return self[name] if name in self else np.full((len(self.block), 1), np.nan)

    @property
    def nanoseconds(self) -> NDArray[np.int64]:
        """Times since the start of the run, (K,) [ns]."""
        return np.rint(self["t"][:, 0] * NANOSECONDS).astype(np.int64)

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Seconds and nanoseconds, (K, 2)."""
        return np.stack(np.divmod(self.nanoseconds, NANOSECONDS), axis=1)
