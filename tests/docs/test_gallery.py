"""The gallery shows every example with its picture and its words."""

import json

import pytest
from tests.docs.making import ROOT, module

pytest.importorskip("PIL", reason='needs the extra "viz": pip install -e ".[viz]"')
PICTURES = ROOT / "docs" / "gallery"


def test_the_page_is_made_of_the_examples_as_they_are():
    gallery = module("gallery")
    printed = json.loads((PICTURES / "printed.json").read_text(encoding="utf-8"))
    assert (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8") == gallery.page(printed)


def test_every_example_has_one_picture_and_three_lines():
    names = {example.stem for example in module("gallery").examples()}
    printed = json.loads((PICTURES / "printed.json").read_text(encoding="utf-8"))
    assert names == set(printed) == {picture.stem for picture in PICTURES.glob("*.png")}
    assert all(len(lines) == 3 for lines in printed.values())
