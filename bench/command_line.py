"""The command line of a script: its docstring is its help."""

import argparse
import sys

from bench.ways import WAYS


def parser(document: str | None) -> argparse.ArgumentParser:
    """A parser without options; the first paragraph of ``document`` is its summary, the rest its epilogue."""
    summary, _, usage = (document or "").partition("\n\n")
    return argparse.ArgumentParser(
        description=summary, epilog=usage, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def at_least_one(text: str) -> int:
    """A whole number that is 1 or more, for ``type`` of an option."""
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"is {text}, expected at least 1, a whole number")
    return int(text)


def say(text: str) -> None:
    """How far it has come, in the last line of a terminal; nothing elsewhere."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\033[K{text}")
        sys.stderr.flush()


def add_ways(parser: argparse.ArgumentParser) -> None:
    """Add the choice of ways in which a step is called."""
    told = f"ways of calling (default {','.join(WAYS)})"
    parser.add_argument("--ways", type=_ways, default=WAYS, metavar="A,B", help=told)


def _ways(text: str) -> tuple[str, ...]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names or not set(names) <= set(WAYS):
        raise argparse.ArgumentTypeError(
            f"is {text!r}, expected some of {', '.join(WAYS)}, commas between them"
        )
    return tuple(way for way in WAYS if way in names)
