"""The playground: pages with a planner in them, built with the site where FTQP_PLAYGROUND says so.

Building takes two minutes of a core the first time, which nobody wants to wait for who looks at a text.
`make docs` builds them.
"""

import logging
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[2]
ASKED = "FTQP_PLAYGROUND"
PAGES = {"panda": "panda-circle", "canadarm2": "canadarm2-wrist"}
"""Names of the pages and the scenarios in them."""
PLACE = "view.md"
HOME, BEFORE = "index.md", "## Three commands"
"""The site's first page, and the part of it before which a visitor may break a joint."""
FRAME = (
    '<iframe src="playground/{name}.html" title="{scenario}" loading="lazy" '
    'style="width:100%;height:42rem;border:1px solid #ccc"></iframe>'
    '<p><a href="playground/{name}.html">The same in a window of its own</a></p>'
)
LEFT_OUT = "*This site was built without the playground: {why}*"


def on_files(files: Files, config: Any) -> Files:
    """Build the pages, and add them to the files of the site."""
    for name in PAGES:
        made = made_page(name)
        if isinstance(made, Path):
            files.append(File.generated(config, f"playground/{name}.html", abs_src_path=str(made)))
        else:
            logging.getLogger("mkdocs.hooks.ftqp").info("LEFT OUT: the playground's %s: %s", name, made)
    return files


def on_page_markdown(markdown: str, page: Any, files: Files, **_: Any) -> str:
    """Put the pages in their places."""
    if page.file.src_uri == HOME:
        name, scenario = next(iter(PAGES.items()))
        if files.get_file_from_path(f"playground/{name}.html") is None:
            return markdown
        frame = FRAME.format(name=name, scenario=scenario)
        return markdown.replace(BEFORE, f"## Break a joint here\n\n{frame}\n\n{BEFORE}", 1)
    if page.file.src_uri != PLACE:
        return markdown
    for name, scenario in PAGES.items():
        there = files.get_file_from_path(f"playground/{name}.html") is not None
        shown = FRAME.format(name=name, scenario=scenario) if there else LEFT_OUT.format(why=made_page(name))
        markdown = markdown.replace(f"<!-- playground {name} -->", shown)
    return markdown


def made_page(name: str) -> Path | str:
    """The file of a page, or why there is none."""
    if not os.environ.get(ASKED):
        return "`make docs` builds it."
    file = ROOT / "build" / "playground" / f"{name}.html"
    if file.is_file():
        return file
    file.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-P", "-m", "ftqp", "build", PAGES[name], "--page", str(file)]
    shown = sys.stderr.isatty()  # there the build says itself how long it still takes
    kept = subprocess.PIPE
    done = subprocess.run(command, stdout=kept, stderr=None if shown else kept, text=True, check=False)
    if done.returncode == 0:
        return file
    return "the reason stands above." if shown else f"{done.stderr.strip().splitlines()[-1]}."
