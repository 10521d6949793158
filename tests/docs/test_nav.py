"""Every page has its place in the navigation, and every place its page."""

import re

import pytest
from tests.docs.making import ROOT, module

pytest.importorskip("mkdocs", reason='needs the extra "docs": pip install -e ".[docs]"')


def in_nav():
    """The pages that the navigation names, in its order."""
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    return re.findall(r"^ *- (?:.*: )?(\S+\.md)$", nav, re.M)


def pages():
    """Every page of the site: those of docs/, those from outside, and those that are made."""
    docs = ROOT / "docs"
    found = {file.relative_to(docs).as_posix() for file in docs.rglob("*.md")}
    found |= {place for place in module("outside_pages").outside() if place.endswith(".md")}
    return found | set(module("reference_pages").pages()) | {module("citations").PLACE}


def test_every_page_is_in_the_navigation_once():
    assert sorted(in_nav()) == sorted(pages())


def test_every_public_name_is_on_one_page_of_the_reference():
    reference = module("reference_pages")
    text = "\n".join(reference.pages().values())
    listed = re.findall(r"^::: (\S+)$", text, re.M) + re.findall(r"^## .*\{: #(\S+) \}$", text, re.M)
    assert sorted(listed) == sorted(reference.public())
