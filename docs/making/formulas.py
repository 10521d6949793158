"""Formulas become MathML when the site is built: no script, no font and no server is needed to show them.

They are written as on GitHub: a block of the language ``math``, or $`...`$ in a line.
"""

import re
from typing import Any

from latex2mathml.converter import convert

BLOCK = re.compile(r"^```math\n(.*?)^```$", re.M | re.S)
INLINE = re.compile(r"\$`([^`\n]+)`\$")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the formulas of a page."""
    markdown = BLOCK.sub(lambda found: f'<div class="formula">{mathml(found[1], "block")}</div>\n', markdown)
    # Markdown takes math at the beginning of a line for a block.
    return INLINE.sub(lambda found: f"<span>{mathml(found[1], 'inline')}</span>", markdown)


def mathml(latex: str, display: str) -> str:
    """A formula in one line of MathML."""
    return re.sub(r"\s*\n\s*", " ", convert(latex.strip(), display=display))
