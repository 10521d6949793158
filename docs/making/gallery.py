"""Make the gallery: run every example, keep its picture and what it prints.

    python docs/making/gallery.py            all of them, in a minute or two
    python docs/making/gallery.py 04 09      some of them; the others stay as they are

The page and its pictures lie in the repository, so that they are seen without a build.
"""

import ast
import json
import subprocess
import sys
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).parents[1]
EXAMPLES = DOCS.parent / "examples"
PICTURES = DOCS / "gallery"
PRINTED = PICTURES / "printed.json"
WIDTH, COLOURS = 1000, 256
"""Of a picture: pixels, and colours that are enough for lines and keep files small."""


def examples() -> list[Path]:
    """The examples in their order."""
    return sorted(EXAMPLES.glob("[0-9]*.py"))


def make(example: Path) -> list[str]:
    """Run an example for its picture; the lines that it prints."""
    picture = PICTURES / f"{example.stem}.png"
    command = [sys.executable, str(example), "--headless", "--figure", str(picture)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    image = Image.open(picture).convert("RGB")
    image.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(picture, optimize=True)
    return done.stdout.strip().splitlines()


def page(printed: dict[str, list[str]]) -> str:
    """The text of the gallery.

    Args:
        printed: What each example printed, by its name without ending.
    """
    lines = [
        "# Gallery",
        "",
        "Seventeen programs, one idea each. Copy the one that is nearest to your task. "
        "`--figure FILE` draws its picture, `python docs/making/gallery.py` this page.",
    ]
    for example in examples():
        story = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8"))) or ""
        title, _, rest = story.partition("\n")
        name = example.stem
        lines += ["", f"## {title.rstrip('.')}", "", " ".join(rest.split()), ""]
        lines += [f"![Picture of {example.name}](gallery/{name}.png)", ""]
        lines += [f"[examples/{example.name}](../examples/{example.name}) prints:", ""]
        lines += [f"    {line}" for line in printed[name]]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Make what is asked for."""
    PICTURES.mkdir(exist_ok=True)
    asked = tuple(sys.argv[1:])
    printed = json.loads(PRINTED.read_text(encoding="utf-8")) if PRINTED.exists() else {}
    for example in examples():
        if not asked or example.name.startswith(asked):
            printed[example.stem] = make(example)
    PRINTED.write_text(json.dumps(printed, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    (DOCS / "gallery.md").write_text(page(printed), encoding="utf-8")


if __name__ == "__main__":
    main()
