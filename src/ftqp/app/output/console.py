"""What the command line says and where: results on stdout, messages and progress on stderr, one exit code."""

import json
import math
import re
import signal
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import IntEnum
from functools import wraps
from inspect import Signature, getdoc, signature
from threading import current_thread, main_thread
from types import FrameType
from typing import Annotated, Any, NamedTuple, ParamSpec

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table as RichTable

from ftqp.core.clock import now
from ftqp.core.errors import FtqpError, ModelError, ScenarioError, printable
from ftqp.core.extras import missing_library
from ftqp.viz.pages import page

PATIENCE = 1_000_000_000
"""Work that takes longer than this gets a progress bar [ns]."""

WIDE = 240
"""Columns of a table that goes into a file or a pipe."""

Parameters = ParamSpec("Parameters")


class ExitCode(IntEnum):
    """What a process of the command line returns; 130 after Ctrl-C, 143 after SIGTERM."""

    DONE = 0
    STOPPED = 1
    BAD_INPUT = 2
    INTERRUPTED = 130
    TERMINATED = 143


def say(text: str) -> None:
    """A message to the person at the terminal, on stderr."""
    Console(stderr=True, highlight=False, markup=False, soft_wrap=True).print(printable(text))


def tell(text: str) -> None:
    """A result for a person, on stdout."""
    Console(highlight=False, markup=False, soft_wrap=True).print(printable(text))


def tell_text(text: str) -> None:
    """A file for whoever wants one, on stdout as it is."""
    sys.stdout.write(text)
    sys.stdout.flush()


def tell_json(content: Mapping[str, Any]) -> None:
    """A result for a program: one JSON object on stdout."""
    tell_text(json_text(content))


class Table(NamedTuple):
    """A table; ``numbers`` are the heads of columns that stand to the right."""

    title: str
    heads: Sequence[str]
    rows: Iterable[Sequence[str]]
    numbers: Collection[str] = ()


Shown = Sequence[str | Table]
"""A result in words: for the terminal, and for a page."""


def answer(facts: Mapping[str, Any], as_json: bool, shown: Shown) -> None:
    """A result for a program, or on the terminal, where blank lines set tables off."""
    if as_json:
        tell_json(facts)
        return
    for at, one in enumerate(shown):
        if at and (isinstance(one, Table) or isinstance(shown[at - 1], Table)):
            tell("")
        if isinstance(one, Table):
            _tell_table(one)
        else:
            tell(one)


def page_parts(shown: Shown) -> list[str]:
    """The same on a page."""
    return [page.table(*one) if isinstance(one, Table) else page.paragraph(one) for one in shown]


def tell_rows(key: str, title: str, rows: Sequence[Mapping[str, str]], as_json: bool) -> ExitCode:
    """Rows of named cells, for a program below a key, for a person as a table."""
    cells = [tuple(row.values()) for row in rows]
    answer({key: list(rows)}, as_json, [Table(title, tuple(rows[0]), cells)])
    return ExitCode.DONE


def json_text(content: Mapping[str, Any]) -> str:
    """``content`` as strict JSON; numbers that JSON does not have (NaN, infinity) become null."""
    return json.dumps(_plain(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    return str(value)


def _tell_table(of: Table) -> None:
    """A table on stdout; as wide as its content when stdout is not a terminal."""
    table = RichTable(title=of.title, title_justify="left", box=None, pad_edge=False, header_style="bold")
    for index, column in enumerate(of.heads):
        table.add_column(
            escape(column),
            overflow="fold",
            no_wrap=index == 0 or column in of.numbers,
            justify="right" if column in of.numbers else "left",
        )
    for row in of.rows:
        table.add_row(*(escape(printable(cell)) for cell in row))
    on_terminal = Console().is_terminal
    Console(highlight=False, width=None if on_terminal else WIDE).print(table)


@contextmanager
def progress(what: str | Callable[[], str], total: float) -> Iterator[Callable[[float], None]]:
    """A bar on stderr that appears once the work takes longer than a second and stderr is a terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done: None
        return
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )
    begin, shown = now(), False
    task = bar.add_task("", total=total)

    def advance(done: float) -> None:
        nonlocal shown
        if not shown and now() - begin > PATIENCE:
            bar.start()
            shown = True
        if shown:
            words = what if isinstance(what, str) else what()
            bar.update(task, completed=done, description=escape(words))

    try:
        yield advance
    finally:
        if shown:
            bar.stop()


OPTION = re.compile(r"(\w+)((?: --?[a-z-]+)*)(?: (\S+))?: (.+)")
"""What is said of a parameter: name, options (none of an argument), what its value is called, help."""
SHARED = """
    scenario SCENARIO: A scenario file, or the name of a bundled one.
    backend --backend NAME: QP backend or profile file, in place of the scenario's.
    scheme --scheme NAME: Scheme, in place of the scenario's.
    overrides --set A.B=VALUE: Replace a value of the scenario (A.B= takes it out); repeatable.
    out --out DIR: Folder to make; runs/<scenario>-<time> if left out.
    plan --plan FILE: A trajectory, made by ftqp plan -o FILE.
    mtbf --mtbf HOURS: Mean time between failures of a joint, or joint=hours,...
    jobs --jobs N: Processes; all cores if left out and the work is long.
    dask --dask ADDRESS: Compute on the workers of this Dask scheduler.
    resume --resume: Go on from what an interrupted run has kept.
    no_figures --no-figures: Draw nothing: a short run, or the facts of an arm, take less time.
    as_json --json: Print one JSON object on stdout and nothing else.
"""
"""Of parameters of several commands; the docstring of a command says it of its own, below ``Options``."""


def _declared(body: Callable[..., ExitCode]) -> tuple[Signature, str]:
    """The signature of a command with what is said of its options, and its docstring without that."""
    text, _, own = (getdoc(body) or "").partition("\n\nOptions:\n")
    said = {}
    for line in f"{SHARED}{own}".replace("\n        ", " ").splitlines():
        if found := OPTION.fullmatch(line.strip()):
            name, flags, metavar, about = found.groups()
            kind: Any = typer.Option if flags else typer.Argument
            said[name] = kind(*flags.split(), metavar=metavar, help=about)
    parameters = [
        one.replace(annotation=Annotated[one.annotation, said[one.name]])
        for one in signature(body).parameters.values()
    ]
    return Signature(parameters), text


def command(body: Callable[Parameters, ExitCode]) -> Callable[Parameters, None]:
    """Makes a command of ``body``: bad input is said in words and ends with 2, Ctrl-C with 130."""

    @wraps(body)
    def run(*args: Parameters.args, **kwargs: Parameters.kwargs) -> None:
        with _termination() as came:
            try:
                code = body(*args, **kwargs)
            except KeyboardInterrupt:
                say("interrupted")
                code = ExitCode.INTERRUPTED
            except FtqpError as error:
                say(f"error: {error}")
                if kwargs.get("as_json"):
                    facts = {"error": str(error).partition("\n")[0]}
                    tell_json({**facts, "errors": list(_details(error))})
                code = ExitCode.BAD_INPUT
            except ImportError as error:
                lacking = missing_library(error)
                if lacking is None:
                    raise
                say(f"error: {lacking}")
                code = ExitCode.BAD_INPUT
        if code is ExitCode.INTERRUPTED and came:
            code = ExitCode.TERMINATED
        raise typer.Exit(int(code))

    run.__signature__, run.__doc__ = _declared(body)  # type: ignore[attr-defined]
    return run


@contextmanager
def _termination() -> Iterator[list[int]]:
    """While entered, SIGTERM raises KeyboardInterrupt, as Ctrl-C does; yields a list of those that came."""
    came: list[int] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    if current_thread() is not main_thread() or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield came
        return
    signal.signal(signal.SIGTERM, interrupt)
    try:
        yield came
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _details(error: FtqpError) -> tuple[str, ...]:
    if isinstance(error, ScenarioError) and error.errors:
        return error.errors
    if isinstance(error, ModelError) and error.findings:
        return error.findings
    return (str(error),)
