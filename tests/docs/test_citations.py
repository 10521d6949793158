"""Works of references.bib as a page shows them."""

import pytest
from tests.docs.making import module

pytest.importorskip("mkdocs", reason='needs the extra "docs": pip install -e ".[docs]"')
from mkdocs.exceptions import PluginError


def test_every_work_says_who_what_where_and_when():
    for key, work in module("citations").works().items():
        assert work["author"] and work["title"] and len(work["year"]) == 4, key
        assert not set("{}\\") & set("".join(work.values())), key


def test_a_work_is_cited_by_its_surnames():
    citations = module("citations")
    works = citations.works()
    assert citations.short(works["holt1994"]) == "Holt and Desrochers 1994"
    assert citations.short(works["jin2017"]) == "Jin et al. 2017"
    assert citations.short(works["delprete2018"]) == "Del Prete 2018"


def test_an_unknown_key_is_an_error():
    page = type("Page", (), {"file": type("File", (), {"src_uri": "theory/x.md"})})
    turned = module("citations").on_page_markdown("as in [@holt1994, eq. 3; @jin2017].", page)
    assert turned == (
        "as in ([Holt and Desrochers 1994](../references.md#holt1994), eq. 3; "
        "[Jin et al. 2017](../references.md#jin2017))."
    )
    with pytest.raises(
        PluginError, match=r"theory/x\.md cites @nobody1999, which docs/references\.bib does not"
    ):
        module("citations").on_page_markdown("[@nobody1999]", page)
