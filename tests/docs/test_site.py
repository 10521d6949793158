"""The site builds without a network, asks nothing of one, and nothing in it is missing."""

import html
import os
import posixpath
import re
import subprocess
import sys
from functools import cache
from types import SimpleNamespace
from urllib.parse import unquote, urlsplit

import pytest
from mkdocs.exceptions import PluginError
from tests.docs.making import ROOT, module
from tests.test_texts import TEXTS, relative
from tests.viz.conftest import browser, opened  # noqa: F401  fixtures

pytest.importorskip("mkdocs", reason='needs the extra "docs": pip install -e ".[docs]"')
LOADED = re.compile(
    r"<(?:script|link|img|source|iframe|video|audio|object)\b[^>]*?\b(?:src|href|data)=[\"']?([^\"'\s>]+)"
)
LINKED = re.compile(r"<a\b[^>]*?\bhref=[\"']?([^\"'\s>]+)")
SAID = re.compile(r"\b(?:id|name)=[\"']?([^\"'\s>]+)")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    environment = os.environ | {
        "NO_MKDOCS_2_WARNING": "1",
        "http_proxy": "http://127.0.0.1:9",
        "https_proxy": "http://127.0.0.1:9",
    }
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def texts(site):
    """The pages of the site by their place."""
    return {
        file.relative_to(site).as_posix(): file.read_text(encoding="utf-8") for file in site.rglob("*.html")
    }


def is_outside(address):
    return bool(urlsplit(address).netloc) or address.startswith("//")


@pytest.mark.slow
def test_no_page_loads_anything_from_outside(site, texts):
    assert len(texts) > 80
    loaded = {one for text in texts.values() for one in LOADED.findall(text)}
    assert "assets/iframe-worker.js" in loaded
    assert not [one for one in loaded if is_outside(one)]
    styles = "\n".join(file.read_text(encoding="utf-8") for file in site.rglob("*.css"))
    assert not re.findall(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", styles)


@pytest.mark.slow
def test_every_link_of_a_page_leads_to_a_page_and_a_place_in_it(site, texts):
    @cache
    def places(name):
        return set(map(html.unescape, SAID.findall(texts[name])))

    wrong = []
    for name, text in texts.items():
        if name == "404.html":  # its links begin at the root of a server
            continue
        for link in {*LINKED.findall(text), *LOADED.findall(text)}:
            address = urlsplit(html.unescape(link))
            if address.scheme or address.netloc:
                if address.scheme not in ("http", "https", "data") or (
                    address.netloc and "." not in address.netloc
                ):
                    wrong.append(f"{name}: {link}")
                continue
            path = unquote(address.path)
            other = posixpath.normpath(posixpath.join(posixpath.dirname(name), path)) if path else name
            there = site / other
            if not there.is_file() or (
                address.fragment and other in texts and unquote(address.fragment) not in places(other)
            ):
                wrong.append(f"{name}: {link}")
    assert not wrong


@pytest.mark.slow
def test_every_table_and_every_list_of_a_text_became_one(texts):
    """A bar too many in a cell, or a list right below a line, would be left as it was written."""
    for name, text in texts.items():
        shown = re.sub(r"(?s)<pre.*?</pre>|<script.*?</script>|<code.*?</code>", "", text)
        assert "|---" not in shown and "| ---" not in shown, name
        assert not re.search(r"<p>[^<]*\n(?:- |1\. |\* )", shown) or name.startswith("reference/api/"), name


@pytest.mark.slow
def test_every_command_and_every_key_of_a_scenario_is_explained(texts):
    from ftqp.app.commands.cli import app
    from ftqp.app.output.tables import keys

    commands = {(one.name or one.callback.__name__).replace("_", "-") for one in app.registered_commands}
    assert set(re.findall(r'<h2 id="ftqp-([\w-]+)">', texts["reference/command-line.html"])) == commands
    cells = re.findall(r"<tr>\n<td><code>([^<]*)</code></td>", texts["reference/scenario.html"])
    assert cells == [row["key"] for row in keys()]


@pytest.mark.slow
def test_every_work_has_its_place_among_the_references_and_citations_lead_there(texts):
    assert set(module("citations").works()) <= set(SAID.findall(texts["references.html"]))
    assert 'href="../references.html#bedrossian1993"' in texts["theory/singularities.html"]
    assert not re.findall(r"\[@\w+", re.sub(r"<code>.*?</code>", "", "".join(texts.values())))


@pytest.mark.slow
def test_formulas_are_mathml_and_no_script(texts):
    theory = texts["theory/index.html"]
    assert theory.count("<math") == 5 and theory.count("<mtr>") == 5
    assert not [
        name
        for name, text in texts.items()
        if "MathJax" in text
        or "$`" in text
        or "&amp;&amp;" in re.sub(r"(?s)<pre.*?</pre>|<script.*?</script>", "", text)
    ]


@pytest.mark.slow
def test_the_index_of_the_search_is_read_from_the_disk(site):
    text = (site / "search" / "search_index.js").read_text(encoding="utf-8")
    assert text.startswith("var __index = {") and "free-swinging" in text


@pytest.mark.slow
def test_the_search_finds_pages_in_a_browser_without_a_network(site, opened):  # noqa: F811
    asked = []
    tab = opened("about:blank", offline=True)
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto((site / "index.html").as_uri())
    tab.fill("input[name=query]", "ftqp.PathFollower")
    found = tab.locator(".md-search-result__link").first
    found.wait_for()
    assert "reference/api/leaders.html" in found.get_attribute("href")
    assert len(asked) > 5 and not [one for one in asked if not one.startswith(("file:", "data:", "about:"))]


SOUGHT = {
    "pandas": "command-line", "how it works": "how-it-works", "bandwidth": "connect-your-robot",
    "protective stop": "troubleshooting", "joystick": "teleoperation", "jerk": "teleoperation",
    "UR": "connect-your-robot", "obstacle": "how-to/obstacle", "wheel": "how-to/several-tasks",
    "ROS": "how-to/controller",
}  # fmt: skip
"""What newcomers look for, and the page that answers it."""


@pytest.mark.slow
def test_what_newcomers_look_for_is_among_the_first_five_pages_that_the_search_finds(site, opened):  # noqa: F811
    first = {}
    for words in SOUGHT:
        tab = opened((site / "index.html").as_uri(), offline=True)
        tab.fill("input[name=query]", words)
        found = tab.locator(".md-search-result__link")
        found.first.wait_for()
        pages = [(one.get_attribute("href") or "").partition(".html")[0] for one in found.all()]
        first[words] = list(dict.fromkeys(pages))[:5]
        tab.close()
    missing = {
        words: first[words]
        for words, page in SOUGHT.items()
        if not any(one.endswith(page) for one in first[words])
    }
    assert not missing


PICTURES = ROOT / "docs" / "gallery"


def test_the_page_is_made_of_the_examples_as_they_are():
    pytest.importorskip("PIL", reason='needs the extra "viz": pip install -e ".[viz]"')
    gallery = module("gallery")
    assert (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8") == gallery.page()


def test_every_example_has_one_picture():
    pytest.importorskip("PIL", reason='needs the extra "viz": pip install -e ".[viz]"')
    names = {example.stem for example in module("gallery").examples()}
    assert names == {picture.stem for picture in PICTURES.glob("*.png")}


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


ELSEWHERE = ("theory/", "evidence/", "solvers/", "benchmarks/", "studies/")
"""Pages that need not be in the navigation, as others lead to them."""


def test_every_page_is_in_the_navigation_once_or_other_pages_lead_to_it():
    nav, known = in_nav(), pages()
    assert len(nav) == len(set(nav)) and set(nav) <= known
    assert all(page.startswith(ELSEWHERE) for page in known - set(nav))
    outside = module("outside_pages")
    files = {page: ROOT / "docs" / page for page in known} | outside.outside()
    found, todo = set(nav), list(nav)
    while todo:
        page = todo.pop()
        text = files[page].read_text(encoding="utf-8") if files[page].is_file() else ""  # else it is made
        for link in LINK.findall(outside.turned(text, page)):
            other = posixpath.normpath(posixpath.join(posixpath.dirname(page), urlsplit(link).path))
            if other in known - found:
                found.add(other)
                todo.append(other)
    assert found == known


def test_every_public_name_is_on_one_page_of_the_reference():
    reference = module("reference_pages")
    text = "\n".join(reference.pages().values())
    listed = re.findall(r"^::: (\S+)$", text, re.M) + re.findall(r"^## .*\{: #(\S+) \}$", text, re.M)
    assert sorted(listed) == sorted(reference.public())


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
