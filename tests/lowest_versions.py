"""``python tests/lowest_versions.py pyproject.toml`` prints the oldest version allowed of each dependency."""

import re
import sys
import tomllib
from pathlib import Path

EXTRAS = ("viz", "sim", "solvers", "ros")
"""Extras whose packages are tried at their oldest, besides what is always installed."""


def lowest(project: dict) -> list[str]:
    """Constraints for pip, one a dependency.

    Args:
        project: the table ``[project]`` of a pyproject.toml.
    """
    wanted = [*project["dependencies"]]
    for extra in EXTRAS:
        wanted += project["optional-dependencies"][extra]
    found = [re.match(r"([A-Za-z0-9_.-]+)>=([0-9.]+)", entry) for entry in wanted]
    return [f"{match[1]}=={match[2]}" for match in found if match]


if __name__ == "__main__":
    print(*lowest(tomllib.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["project"]), sep="\n")
