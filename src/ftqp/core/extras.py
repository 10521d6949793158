"""How to install what is missing: extras from the place that ftqp itself came from, as no index has it."""

import re
from pathlib import Path

NAME = "ftqp"
SHARED = re.compile(r"\b(lib([\w+-]+)\.so\.(\d+))\S*: cannot open shared object file")
"""What the loader of a system says of a library that is not there."""


def missing_library(error: ImportError) -> str | None:
    """The system's library that a package lacks, in a sentence; None where it fails otherwise."""
    found = SHARED.search(str(error))
    if found is None:
        return None
    file, name, number = found.groups()
    package = f"lib{name}{'-' if name[-1].isdigit() else ''}{number}".lower()
    return (
        f"{file} is not on this machine, a library of the system that a package of Python needs; "
        f"Debian, Ubuntu: apt install {package}"
    )


def remedy_for_extra(extra: str) -> str:
    """The command that installs an extra of this ftqp, for example ``pip install -e "/home/me/ftqp[viz]"``.

    It names the checkout that this module belongs to; where that is none it says to go to a clone.
    """
    checkout = Path(__file__).parents[3]
    if (checkout / "pyproject.toml").is_file() and (checkout / "src" / NAME / "core").is_dir():
        return f'pip install -e "{checkout}[{extra}]"'
    return f'pip install ".[{extra}]" in a clone of its repository'
