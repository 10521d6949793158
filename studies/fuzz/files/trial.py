"""One file of a kind, drawn from a seed and a number: made in a folder of its own, used, judged."""

import logging
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Final

from fuzz.files import binary_kinds, kinds, shop
from fuzz.files.kinds import Case
from fuzz.files.promises import Outcome, judged
from fuzz.files.workshop import workshop

KINDS: Final[dict[str, tuple[Callable[[Random, Path], Case], str]]] = {
    "scenario": (kinds.scenario, "scenario in TOML; made, and run for four ticks"),
    "overrides": (kinds.overrides, "`--set A.B=VALUE` of a scenario; made, and run for four ticks"),
    "campaign": (kinds.campaign, "campaign in TOML; three episodes drawn, made, and run for four ticks"),
    "study": (kinds.study, "study of a workspace in TOML; one start computed"),
    "profile": (kinds.profile, "profile of a solver in TOML; a QP solved"),
    "table": (kinds.table, "waypoints and recorded motions in CSV"),
    "log": (binary_kinds.log, "log of a run in SQLite; told in words, exported, played"),
    "results": (binary_kinds.results, "results of a campaign in SQLite; gone on with, reported"),
    "plan": (binary_kinds.plan, "plan in NPZ; leads a planner for four ticks"),
    "verdicts": (binary_kinds.verdicts, "verdicts of a coverage report in JSON"),
    "calibration": (binary_kinds.calibration, "calibration of a detector in JSON; watches four ticks"),
    "summary": (binary_kinds.summary, "summary of a campaign in JSON; reported"),
}
"""Kinds of files: how one is drawn, and what is done with it."""


def tried(kind: str, rng: Random) -> Outcome:
    """A file of a kind, made and used in an empty folder."""
    workshop()
    logging.disable(logging.CRITICAL)
    before = os.getcwd()
    with tempfile.TemporaryDirectory(prefix="ftqp-files-") as made:
        folder = shop.furnished(Path(made))
        case = KINDS[kind][0](rng, folder)
        os.chdir(folder)
        try:
            return judged(case.use, folder, files=(case.file,))
        finally:
            os.chdir(before)
            logging.disable(logging.NOTSET)


def numbered(kind: str, seed: int, number: int) -> Outcome:
    """The file of a number."""
    return tried(kind, Random(f"{seed} {kind} {number}"))


def shown(kind: str, seed: int, number: int) -> None:
    """Write the text of a file to the screen, where it has one."""
    with tempfile.TemporaryDirectory(prefix="ftqp-files-") as made:
        case = KINDS[kind][0](Random(f"{seed} {kind} {number}"), shop.furnished(Path(made)))
        if case.file.is_file():
            sys.stdout.write(ascii(case.file.read_bytes()[:4000]).replace("\\n", "\n") + "\n")
