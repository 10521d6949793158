"""A page is one file that a browser shows without fetching anything, whatever texts it is given."""

from html.parser import HTMLParser

import numpy as np
import pytest

from ftqp.viz.pages.page import heading, page, paragraph, picture, table

PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010802000000907753de0000000c4944415408d763f8cfc0000003010100"
    "18dd8db00000000049454e44ae426082"
)


class Reader(HTMLParser):
    """What a browser finds: texts, addresses, and tags that are left open."""

    def __init__(self):
        super().__init__()
        self.texts, self.addresses, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        self.addresses += [value for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture
def read(tmp_path):
    file = tmp_path / "p.png"
    file.write_bytes(PIXEL)
    text = page(
        "arm <script>",
        [
            heading("a & b"),
            paragraph("run `ftqp plan <x>` now"),
            table("rows", ("joint", "share"), [("j<1>", "0.5")], numbers=("share",)),
            picture(file, 'what "is" seen'),
        ],
        footer="made by <me>",
    )
    reader = Reader()
    reader.feed(text)
    return reader, text


def test_every_tag_is_closed_and_texts_stay_texts(read):
    reader, text = read
    assert reader.open == []
    found = "".join(reader.texts)
    for part in ("arm <script>", "a & b", "ftqp plan <x>", "j<1>", "made by <me>"):
        assert part in found
    assert "<script" not in text
    assert "<code>ftqp plan &lt;x&gt;</code>" in text
    assert '<td class="number">0.5</td>' in text


def test_nothing_is_fetched_from_elsewhere(read):
    reader, text = read
    assert len(reader.addresses) == 1
    assert reader.addresses[0].startswith("data:image/png;base64,")
    assert "http" not in text
    assert "url(" not in text


@pytest.fixture
def svg(tmp_path):
    """A figure as it is saved and as it stands in a page."""
    pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')
    from ftqp.viz.figures.canvas import curve, paper, save, tidy
    from ftqp.viz.report.run_report import cleaned

    figure = paper(4.0, 3.0, "error 0.00085 <mm>")
    axes = figure.add_subplot()
    t = np.linspace(0.0, 1.0, 50_000)
    y = np.zeros(len(t))
    y[31_415] = 1.0
    curve(axes, t, y)
    tidy(axes, "time [s]", "")
    saved = save(figure, tmp_path / "a.svg").read_text(encoding="utf-8")
    return saved, cleaned(saved)


def test_texts_of_a_figure_are_text_with_all_their_digits(svg):
    assert "error 0.00085 &lt;mm&gt;" in svg[1]


def test_no_outside_address_of_a_figure_is_left(svg):
    saved, text = svg
    assert "http" in saved and "http" not in text
    assert "xlink" not in text
    assert text.startswith("<svg") and text.rstrip().endswith("</svg>")
