"""What ``pip install ftqp`` brings: no package under the GPL, and the LGPL only where it is named."""

import importlib.metadata as metadata
import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LESSER = {"qpsolvers"}
"""Packages under the LGPL that are installed by default; SECURITY.md names them."""


def installed(requirements):
    """Every package that these bring, with its distribution; markers of other systems are left out."""
    found, waiting = {}, [Requirement(text) for text in requirements]
    while waiting:
        wanted = waiting.pop()
        name = re.sub(r"[-_.]+", "-", wanted.name).lower()
        extras = wanted.extras or {""}
        if name in found or (wanted.marker and not any(wanted.marker.evaluate({"extra": e}) for e in extras)):
            continue
        found[name] = metadata.distribution(name)
        for text in found[name].requires or ():
            inner = Requirement(text)
            if not inner.marker or any(inner.marker.evaluate({"extra": e}) for e in extras):
                inner.marker = None
                waiting.append(inner)
    return found


def licence(distribution):
    """What a distribution says of its licence: the expression, else the classifiers, else the field."""
    about = distribution.metadata
    classifiers = [text for text in about.get_all("Classifier", []) if text.startswith("License ::")]
    return about.get("License-Expression") or "; ".join(classifiers) or about.get("License") or ""


def is_gpl(text):
    return bool(re.search(r"(?<!L)(?<!Lesser )\bA?GPL|(?<!Lesser )General Public License", text))


def test_gpl_is_told_from_lgpl():
    assert (
        is_gpl("GPL-2.0-or-later")
        and is_gpl("AGPL-3.0")
        and is_gpl("OSI :: GNU General Public License v3 (GPLv3)")
    )
    assert not is_gpl("LGPL-3.0-only") and not is_gpl("GNU Lesser General Public License v3 (LGPLv3)")
    assert not is_gpl("MIT")


def test_no_package_that_is_installed_by_default_is_under_the_gpl():
    texts = {name: licence(one) for name, one in installed(PROJECT["dependencies"]).items()}
    assert len(texts) > 15
    assert {name for name, text in texts.items() if is_gpl(text)} == set()


def test_packages_under_the_lgpl_are_named():
    texts = {name: licence(one) for name, one in installed(PROJECT["dependencies"]).items()}
    lesser = {name for name, text in texts.items() if re.search("LGPL|Lesser", text)}
    assert lesser == LESSER
    named = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert all(name in named for name in lesser)


def test_solvers_under_the_gpl_are_in_an_extra_with_their_licence_beside_them():
    lines = (ROOT / "pyproject.toml").read_text(encoding="utf-8").splitlines()
    quadprog = [line for line in lines if '"quadprog' in line and "#" in line]
    assert quadprog and all("GPL" in line for line in quadprog)
    assert not any("quadprog" in text for text in PROJECT["dependencies"])
