"""Links of the texts lead somewhere: to a file, to a heading in it, or to an address that can be one."""

import re
from urllib.parse import urlsplit

import pytest
from tests.test_texts import TEXTS, relative

CODE = re.compile(r"^```.*?^```$|`[^`\n]+`", re.M | re.S)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def anchors(text):
    """The anchors that GitHub gives to the headings of a text."""
    found = []
    for heading in re.findall(r"^#+ +(.*?) *$", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S), re.M):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")
        count = sum(one.rpartition("-")[0] == anchor or one == anchor for one in found)
        found.append(f"{anchor}-{count}" if anchor in found else anchor)
    return found


def wrong_links(file, text):
    wrong = []
    for target in LINK.findall(CODE.sub("", text)):
        address = urlsplit(target)
        if address.scheme:
            right = address.scheme in ("http", "https") and "." in address.netloc
        else:
            other = file if not address.path else (file.parent / address.path).resolve()
            right = other.exists()
            if right and address.fragment:
                right = address.fragment in anchors(other.read_text(encoding="utf-8"))
        if not right:
            wrong.append(target)
    return wrong


@pytest.mark.parametrize("file", TEXTS, ids=relative)
def test_every_link_leads_to_a_file_a_heading_or_an_address(file):
    assert not wrong_links(file, file.read_text(encoding="utf-8"))


def test_a_wrong_link_is_found():
    wrong = ["none.md", "README.md#nothing", "htp://x.y", "https://nowhere"]
    text = "# Some `code` here\n" + " ".join(f"[a]({link})" for link in [*wrong, "#some-code-here"])
    assert wrong_links(TEXTS[0], text) == [*wrong, "#some-code-here"]  # there is no such heading in README
    assert anchors(text) == ["some-code-here"]
