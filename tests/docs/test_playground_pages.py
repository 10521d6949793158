"""Where the site has the pages in which a visitor breaks joints."""

from types import SimpleNamespace

import pytest
from tests.docs.making import ROOT, module

pytest.importorskip("mkdocs", reason='needs the extra "docs": pip install -e ".[docs]"')
README = (ROOT / "README.md").read_text(encoding="utf-8")


def shown(place, text, built):
    """A page of the site, where these pages were built."""
    files = SimpleNamespace(get_file_from_path=lambda path: path if path in built else None)
    page = SimpleNamespace(file=SimpleNamespace(src_uri=place))
    return module("playground_pages").on_page_markdown(text, page, files)


def test_a_visitor_of_the_first_page_may_break_a_joint_there():
    text = shown("index.md", README, {"playground/panda.html"})
    before, _, after = text.partition('<iframe src="playground/panda.html"')
    assert before.rstrip().endswith("## Break a joint here") and "## Three commands" in after
    assert text.replace("## Break a joint here", "").count("##") == README.count("##")


def test_the_first_page_is_as_it_is_where_no_page_was_built():
    assert shown("index.md", README, set()) == README
