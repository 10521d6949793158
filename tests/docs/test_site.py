"""The site builds without a network, asks nothing of one, and nothing in it is missing."""

import html
import os
import posixpath
import re
import subprocess
import sys
from functools import cache
from urllib.parse import unquote, urlsplit

import pytest
from tests.docs.making import ROOT, module
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


def test_no_page_loads_anything_from_outside(site, texts):
    assert len(texts) > 80
    loaded = {one for text in texts.values() for one in LOADED.findall(text)}
    assert "assets/iframe-worker.js" in loaded
    assert not [one for one in loaded if is_outside(one)]
    styles = "\n".join(file.read_text(encoding="utf-8") for file in site.rglob("*.css"))
    assert not re.findall(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", styles)


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


def test_every_table_and_every_list_of_a_text_became_one(texts):
    """A bar too many in a cell, or a list right below a line, would be left as it was written."""
    for name, text in texts.items():
        shown = re.sub(r"(?s)<pre.*?</pre>|<script.*?</script>|<code.*?</code>", "", text)
        assert "|---" not in shown and "| ---" not in shown, name
        assert not re.search(r"<p>[^<]*\n(?:- |1\. |\* )", shown) or name.startswith("reference/api/"), name


def test_every_public_name_has_its_place_in_the_reference(texts):
    found = {
        one for name, text in texts.items() if name.startswith("reference/api/") for one in SAID.findall(text)
    }
    public = module("reference_pages").public()
    assert len(public) > 150 and not set(public) - found


def test_every_command_and_every_key_of_a_scenario_is_explained(texts):
    from ftqp.app.commands.cli import app
    from ftqp.app.output.tables import keys

    commands = {(one.name or one.callback.__name__).replace("_", "-") for one in app.registered_commands}
    assert set(re.findall(r'<h2 id="ftqp-([\w-]+)">', texts["reference/command-line.html"])) == commands
    cells = re.findall(r"<tr>\n<td><code>([^<]*)</code></td>", texts["reference/scenario.html"])
    assert cells == [row["key"] for row in keys()]


def test_every_work_has_its_place_among_the_references_and_citations_lead_there(texts):
    assert set(module("citations").works()) <= set(SAID.findall(texts["references.html"]))
    assert 'href="../references.html#bedrossian1993"' in texts["theory/singularities.html"]
    assert not re.findall(r"\[@\w+", re.sub(r"<code>.*?</code>", "", "".join(texts.values())))


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


def test_the_index_of_the_search_is_read_from_the_disk(site):
    text = (site / "search" / "search_index.js").read_text(encoding="utf-8")
    assert text.startswith("var __index = {") and "free-swinging" in text


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
