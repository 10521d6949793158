"""The command line of a script: its docstring is its help."""

import argparse


def parser(document: str | None) -> argparse.ArgumentParser:
    """A parser without options; the first paragraph of ``document`` is its summary, the rest its epilogue."""
    summary, _, usage = (document or "").partition("\n\n")
    return argparse.ArgumentParser(
        description=summary, epilog=usage, formatter_class=argparse.RawDescriptionHelpFormatter
    )
