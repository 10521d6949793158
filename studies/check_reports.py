"""Whether the report of every bundled scenario opens offline, asks for nothing and stays below 4 MB.

Every bundled scenario is run as it is, `ftqp report` makes its page, and the page is read and opened:

    addresses   outside addresses in any src, href, srcset, action, data or poster, and in any url() of a
                style, in the page and in the page of the replay within it,
    requests    what a headless Chromium, its network switched off, asked for beside the file itself,
    canvas      whether the replay made the canvas on which the arm is drawn.

    python studies/check_reports.py [SCENARIO...] [--seconds S] [--out DIR] [--json]

All of them take some six minutes on one core; ``--seconds`` shortens the runs. Without playwright or Chromium
(FTQP_CHROMIUM) the last two columns are empty, and the report says so. The exit code is 1 where a page breaks
one of these rules.
"""

import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from bench import command_line, results

from ftqp.app.commands.reporting import LARGEST, made, read_result
from ftqp.app.run import runs
from ftqp.app.scenario import document
from ftqp.app.scenario.setup import load

ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-dev-shm-usage",
)  # fmt: skip
WAITS = 60_000.0
"""How long a page may take to draw [ms]."""
OUTSIDE = re.compile(r"^\s*(?:[a-z][a-z0-9+.-]*:)?//|^\s*(?:https?|ftp):", re.IGNORECASE)
NAMED = ("src", "href", "srcset", "action", "data", "poster", "xlink:href")
LIMITATIONS = (
    "A request that a script would make only after a click is not seen.",
    "One browser, Chromium, in software.",
)
Opened = Callable[[Path, bool], tuple[list[str], bool]]


class Addresses(HTMLParser):
    """All addresses of a page and of the pages within it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.replays = 0
        self._tag = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._tag = tag
        for name, value in attrs:
            if name in NAMED:
                self.found.append(value or "")
            elif name == "style":
                self._styles(value or "")
            elif name == "srcdoc":
                self.replays += 1
                self.found += Addresses(value or "").found

    def handle_endtag(self, tag: str) -> None:
        self._tag = ""

    def handle_data(self, data: str) -> None:
        if self._tag == "style":
            self._styles(data)

    def _styles(self, text: str) -> None:
        self.found += re.findall(r"url\(\s*['\"]?([^)'\"]*)", text)


@contextmanager
def browser() -> Iterator[Opened | None]:
    """What opens a page: which requests it made, and whether its replay has a canvas; None without one."""
    program = os.environ.get("FTQP_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        program = None
    if program is None:
        yield None
        return
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=program, args=list(ARGUMENTS))

        def opened(file: Path, replayed: bool) -> tuple[list[str], bool]:
            context = running.new_context(offline=True, viewport={"width": 700, "height": 500})
            asked: list[str] = []
            tab = context.new_page()
            tab.on("request", lambda request: asked.append(request.url))
            tab.goto(file.as_uri())
            if replayed:
                inner = tab.locator("iframe")
                inner.scroll_into_view_if_needed()
                tab.frame_locator("iframe").locator("canvas").first.wait_for(timeout=WAITS)
            context.close()
            beside = [url for url in asked if url != file.as_uri() and not url.startswith(("data:", "blob:"))]
            return beside, replayed

        yield opened
        running.close()


def checked(name: str, folder: Path, seconds: float | None, opened: Opened | None) -> dict[str, Any]:
    """One scenario: run, reported, read and opened."""
    shorter = [] if seconds is None else [f"simulation.duration={seconds:g}"]
    run = runs.run(load(name, shorter), folder / name, drawn=False)
    text, notes = made([read_result(run.folder, name)], full=False)
    file = folder / f"{name}.html"
    file.write_text(text, encoding="utf-8")
    page = Addresses(text)
    row: dict[str, Any] = {
        "scenario": name,
        "steps": run.summary["steps"],
        "bytes": len(text.encode()),
        "addresses": sorted({address[:80] for address in page.found if OUTSIDE.match(address)}),
        "replay": page.replays == 1,
        "notes": notes,
        "requests": None,
        "canvas": None,
    }
    if opened is not None:
        requests, canvas = opened(file, page.replays == 1)
        row |= {"requests": requests, "canvas": canvas}
    row["broken"] = [
        what
        for what, bad in (
            ("too large", row["bytes"] > LARGEST),
            ("outside address", bool(row["addresses"])),
            ("request", bool(row["requests"])),
            ("no replay", not row["replay"]),
        )
        if bad
    ]
    return row


def markdown(result: dict[str, Any]) -> str:
    """The table for a reader."""
    rows = result["rows"]
    broken = [row for row in rows if row["broken"]]
    largest = max(row["bytes"] for row in rows)
    lines = [
        *results.preamble("Reports of the bundled scenarios", result),
        f"{len(rows)} reports, {len(broken)} of them break a rule; the largest has {largest / 1e6:.2f} MB of "
        f"{LARGEST / 1e6:g} MB.",
        "",
        "| scenario | steps | MB | outside addresses | requests | replay | canvas | broken |",
        "|---|---:|---:|---:|---:|---|---|---|",
    ]
    for row in rows:
        requests = "-" if row["requests"] is None else len(row["requests"])
        canvas = "-" if row["canvas"] is None else "yes" if row["canvas"] else "no"
        lines.append(
            f"| {row['scenario']} | {row['steps']} | {row['bytes'] / 1e6:.2f} | {len(row['addresses'])} "
            f"| {requests} | {'yes' if row['replay'] else 'no'} | {canvas} | {', '.join(row['broken'])} |"
        )
    return "\n".join([*lines, "", *results.appendix(result)])


def main() -> int:
    """Checks, prints, writes; 1 where a report breaks a rule, 2 for bad input."""
    parser = command_line.parser(__doc__)
    parser.add_argument("scenarios", nargs="*", metavar="SCENARIO", help="all bundled ones if left out")
    parser.add_argument("--seconds", type=float, help="simulated seconds of each run, at most")
    results.add_out(parser, "check_reports")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    names = given.scenarios or list(document.bundled())
    left_out: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder, browser() as opened:
        if opened is None:
            left_out["browser"] = "needs playwright and Chromium (apt install chromium, or FTQP_CHROMIUM)"
        rows = [checked(name, Path(folder), given.seconds, opened) for name in names]
    settings = {"scenarios": len(names), "seconds": given.seconds or "all of them"}
    result = results.circumstances("check_reports", (), settings)
    result |= {"rows": rows, "left_out": left_out, "limitations": list(LIMITATIONS)}
    quick = bool(given.scenarios) or given.seconds is not None
    name = results.stem("check_reports", name=None, quick=quick)
    wrong = results.told(result, markdown(result), given.out, name, as_json=given.json)
    return wrong or int(any(row["broken"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
