"""Backend profiles: a TOML file with the name of a backend and its settings."""

import tomllib
from pathlib import Path
from typing import Any

from ftqp.core.checks import LARGEST as MOST
from ftqp.core.checks import beyond
from ftqp.core.errors import InputError

LARGEST = 64 * 1024
"""Bytes of the largest file that is read as a profile; real ones have a few lines."""


def profile(path: str | Path) -> dict[str, Any]:
    """The content of a profile, to be handed to ``ftqp.qp.backend``.

        name = "osqp" tolerance = 1e-9

    Raises:
        InputError: No such file, not a TOML file, too large, or without ``name``.
    """
    path = Path(path)
    try:
        if not (path.is_file() or path.is_dir()) and path.exists():
            raise InputError(f"profile {path} is not a regular file; expected a TOML file")
        if path.stat().st_size > LARGEST:
            raise InputError(
                f"profile {path} has {path.stat().st_size} bytes, expected a TOML file of at most {LARGEST}"
            )
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or error
        raise InputError(f"profile {path} cannot be read ({reason}); expected a TOML file") from error
    except UnicodeDecodeError as error:
        raise InputError(f"profile {path} is not a text file; expected a TOML file") from error
    try:
        content = tomllib.loads(text)
        large = next(beyond(content), None)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"profile {path} is not valid TOML: {error}") from error
    except (RecursionError, ValueError) as error:
        raise InputError(
            f"profile {path} is not valid TOML: nested too deeply or a number out of range"
        ) from error
    if large is not None:
        raise InputError(
            f"profile {path}: {large} is a whole number beyond {MOST:g} in size, expected one within it"
        )
    if "name" not in content:
        raise InputError(f'profile {path} has no name; expected a line like name = "daqp"')
    return content
