"""A picture in memory, which a notebook shows and a script saves."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, final


@final
class Picture:
    """A PNG file (``png``) and its ``title``: a notebook shows it, ``save`` writes it."""

    __slots__ = ("_png", "title")

    def __init__(self, png: bytes, title: str) -> None:
        self._png, self.title = png, title

    def __repr__(self) -> str:
        """What it shows, and how to keep it."""
        return f"<picture: {self.title}; .save('file.png') keeps it>"

    def _repr_png_(self) -> bytes:
        """The bytes, for notebooks."""
        return self._png

    def save(self, path: str | Path) -> Path:
        """Write the picture to a PNG file, whose folder must be there."""
        try:
            Path(path).write_bytes(self._png)
        except OSError as error:
            from ftqp.core.errors import InputError  # `import ftqp` needs this file, and no sentences

            raise InputError(f"picture {path} cannot be written: {error.strerror}") from error
        return Path(path)


PAINTERS: dict[str, Callable[..., Any]] = {}
"""What draws a robot, a run or a report: pictures are above all of these, and ``ftqp`` itself, which is above
them, names what makes them."""


def painted(what: str, *given: Any) -> Any:
    """A picture of something by the painter that was named for it."""
    return PAINTERS[what](*given)
