"""Make the gallery: run every example for its picture, and write the page.

    python docs/making/gallery.py            all of them, in a minute or two
    python docs/making/gallery.py 04 09      some of them; the others stay as they are

The page and its pictures lie in the repository, so that they are seen without a build.
"""

import ast
import subprocess
import sys
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).parents[1]
EXAMPLES = DOCS.parent / "examples"
PICTURES = DOCS / "gallery"
WIDTH, COLOURS = 1000, 256
"""Of a picture: pixels, and colours that are enough for lines and keep files small."""


def examples() -> list[Path]:
    """The examples in their order."""
    return sorted(EXAMPLES.glob("[0-9]*.py"))


def make(example: Path) -> None:
    """Run an example for its picture."""
    picture = PICTURES / f"{example.stem}.png"
    command = [sys.executable, str(example), "--headless", "--figure", str(picture)]
    subprocess.run(command, check=True)
    image = Image.open(picture).convert("RGB")
    image.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(picture, optimize=True)


def page() -> str:
    """The text of the gallery."""
    lines = [
        "# Gallery",
        "",
        "Eighteen programs, one idea each ([how ftqp works](how-it-works.md)). Copy the one that is nearest "
        "to your task. Each prints three numbers; `--figure FILE` draws its picture, and "
        "`python docs/making/gallery.py` this page.",
    ]
    for example in examples():
        story = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8"))) or ""
        title, _, rest = story.partition("\n")
        name = example.stem
        lines += ["", f"## {title.rstrip('.')}", "", " ".join(rest.split()), ""]
        lines += [f"![Picture of {example.name}](gallery/{name}.png)", ""]
        lines += [f"[examples/{example.name}](../examples/{example.name})"]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Make what is asked for."""
    PICTURES.mkdir(exist_ok=True)
    asked = tuple(sys.argv[1:])
    for example in examples():
        if not asked or example.name.startswith(asked):
            make(example)
    (DOCS / "gallery.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
