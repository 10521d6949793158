"""The reference, made from the program itself: keys of a scenario, commands, Python interface."""

from types import ModuleType
from typing import Any

import typer
from mkdocs.structure.files import File, Files

import ftqp
from ftqp.app.commands.cli import app
from ftqp.app.output.tables import keys, robots, schemes
from ftqp.app.scenario import document

PARTS = {
    "planner": ("The planner and its steps", ("ftqp.control.planner",)),
    "tasks": ("Task, scheme, bounds, damping", ("ftqp.control.task", "ftqp.kernel")),
    "arms": ("Robots, loads, limits", ("ftqp.model",)),
    "scenes": ("What stands around an arm", ("ftqp.control.scene",)),
    "drives": ("Drives and noise", ("ftqp.control.drive",)),
    "leaders": (
        "What leads an arm, postures, and rates",
        tuple(
            f"ftqp.control.{room}"
            for room in ("following", "references", "moving_base", "rates", "inverse_kinematics")
        ),
    ),
    "faults": ("Faults and their detection", ("ftqp.faults",)),
    "simulation": ("Simulation, scenarios, logs, the page", ("ftqp.sim", "ftqp.app", "ftqp.viz")),
    "solvers": ("QPs and backends", ("ftqp.qp",)),
    "errors": ("Errors", ("ftqp.core",)),
}
"""Pages for the names of `ftqp` itself: the folders where these names live."""
MODULES = {
    "schemes": ("ftqp.schemes", "Schemes"),
    "bounds": ("ftqp.bounds", "Bounds by name"),
    "paths": ("ftqp.paths", "Paths"),
    "robots": ("ftqp.robots", "The catalog of robots"),
    "batch": ("ftqp.batch", "Many arms at once"),
    "analysis": ("ftqp.analysis", "Studies before the mission"),
    "qp": ("ftqp.qp", "QPs alone"),
    "vendors": ("ftqp.vendors", "Status words of controllers and drives"),
    "dtrnn": ("ftqp.qp.dtrnn", "The recurrent network"),
}
"""Pages for the public modules."""


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of the reference."""
    for place, text in pages().items():
        files.append(File.generated(config, place, content=text))
    return files


def pages() -> dict[str, str]:
    """Every page of the reference by its place in the site."""
    made = {"reference/scenario.md": _scenario(), "reference/command-line.md": _command_line()}
    made["reference/tables.md"] = _tables()
    made["reference/vendors.md"] = _vendors()
    for name, (title, _) in PARTS.items():
        names = [one for one in exported() if part_of(one) == name]
        made[f"reference/api/{name}.md"] = _listing(title, names)
    for name, (module, title) in MODULES.items():
        made[f"reference/api/module-{name}.md"] = _listing(title, members(module), f"Module `{module}`.")
    return made


def public() -> list[str]:
    """Every public name: those of `ftqp` and of its public modules."""
    return [*exported(), *(name for module, _ in MODULES.values() for name in members(module))]


def exported() -> list[str]:
    """The names of `ftqp` that are no modules."""
    names = [name for name in sorted(ftqp.__all__) if not name.startswith("_")]
    return [f"ftqp.{name}" for name in names if not isinstance(getattr(ftqp, name), ModuleType)]


def members(module: str) -> list[str]:
    """The public names of a module: what it lists, or what it defines and gives on under the same name."""
    holder = _found(module)
    names = getattr(holder, "__all__", None) or [
        name for name, value in vars(holder).items() if name[0] != "_" and _is_its_own(value, holder)
    ]
    return [f"{module}.{name}" for name in names if not isinstance(getattr(holder, name), ModuleType)]


def part_of(name: str) -> str:
    """The page of a name of `ftqp`.

    Raises:
        LookupError: its folder is on no page.
    """
    home = _found(name).__module__
    for part, (_, folders) in PARTS.items():
        if home.startswith(folders):
            return part
    raise LookupError(f"{name} lives in {home}, which PARTS of docs/making/reference_pages.py does not name")


def _found(name: str) -> Any:
    found: Any = ftqp
    for part in name.split(".")[1:]:
        found = getattr(found, part)
    return found


def _is_its_own(value: object, holder: ModuleType) -> bool:
    """Whether a module gives this to its users, and does not only use it."""
    if isinstance(value, ModuleType):
        return False
    home = getattr(value, "__module__", "")
    package = getattr(holder, "__path__", None) is not None
    return home == holder.__name__ or (package and home.startswith(f"{holder.__name__}."))


def _listing(title: str, names: list[str], before: str = "") -> str:
    """A page of the interface; what has a docstring is laid out from it."""
    return "\n\n".join([f"# {title}", *([before] if before else []), *map(_entry, names)]) + "\n"


def _entry(name: str) -> str:
    """A name's place on its page; what `ftqp` itself exports, too, is laid out there."""
    found = _found(name)
    same = [one for one in exported() if _found(one) is found]
    if same and same[0] != name:
        return f"## `{name}` {{: #{name} }}\n\nIt is [`{same[0]}`][{same[0]}]."
    return f"::: {name}"


def _scenario() -> str:
    lines = [
        "# Keys of a scenario",
        "",
        "What `ftqp check --keys` prints. A scenario is a TOML file; an unknown key is an error that names "
        "the nearest valid one. `ftqp check panda-circle > my.toml` writes a bundled scenario with every "
        "default filled in, to start from. A bracket behind a table's name, as in `path(circle)`, is the "
        "`kind` for which its keys are.",
    ]
    table = ""
    for row in keys():
        head = row["key"].partition(".")[0].partition("(")[0] if "." in row["key"] else "the file itself"
        if head != table:
            table = head
            lines += ["", f"## {table}", "", *_head("key", "default", "unit", "meaning")]
        default = f"`{row['default']}`" if row["default"] not in ("", "needed") else row["default"]
        lines.append(_row(f"`{row['key']}`", default, row["unit"], row["meaning"]))
    return "\n".join(lines) + "\n"


def _tables() -> str:
    """What `ftqp robots`, `ftqp schemes`, `ftqp check` and `ftqp workspace` list."""
    story, minimised = ("name", "story"), ("name", "what it minimises", "gains")
    listed = [
        ("Robots", "ftqp robots", ("name", "what it is"), [tuple(row.values()) for row in robots()]),
        ("Schemes", "ftqp schemes", minimised, [tuple(row.values()) for row in schemes()]),
        ("Scenarios", "ftqp check", story, list(document.bundled().items())),
        ("Studies", "ftqp workspace", story, list(document.bundled("study").items())),
    ]
    lines = ["# Robots, schemes, scenarios", "", "What comes with ftqp."]
    for title, asked, head, rows in listed:
        lines += ["", f"## {title}", "", f"What `{asked}` lists.", "", *_head(*head)]
        lines += [_row(f"`{name}`", *rest) for name, *rest in rows]
    return "\n".join(lines) + "\n"


GOES_ON = {"yes": "yes", "no": "no", "held": "only beside a joint that is left at rest on purpose"}


def _vendors() -> str:
    """The tables of `ftqp.vendors`."""
    tables = [ftqp.vendors.table(name) for name in ftqp.vendors.names()]
    lines = [
        "# Status words of vendors' controllers",
        "",
        "What `ftqp.vendors` makes of them, and how an arm comes back: [how to use it](../how-to/lerobot.md)."
        " A value that no row has is unknown and pauses the arm. A question mark: it stands in no text of "
        "the maker. Nothing here was tried on hardware.",
        "",
        *_head("name", "hardware", "do the remaining joints go on after a fault", "why"),
        *(_row(f"`{one.name}`", one.title, GOES_ON[one.goes_on], one.evidence) for one in tables),
    ]
    for one in tables:
        lines += ["", f"## {one.title}", "", f"`{one.name}`, made from: {one.version}."]
        for key, word in one.words.items():
            lines += [
                "",
                f"`{key}` is the {word.title}, of {'each joint' if word.of == 'joint' else 'the arm'}.",
            ]
            lines += ["", *_head("value", "meaning", "joint", "arm", "back to work")]
            lines += [_meaning(row) for row in word.rows]
        for key, steps in one.recovery.items():
            told = [
                f"{step.by}: {step.do}{f', not before {step.after:g} s' * bool(step.after)}" for step in steps
            ]
            lines += ["", f"*{key}*", "", *(f"{k}. {text}" for k, text in enumerate(told, 1))]
        lines += ["", f"Temperature: {one.temperature}. Sources: {'; '.join(one.sources)}."]
    return "\n".join(lines) + "\n"


def _meaning(row: Any) -> str:
    """A row of a table of status words."""
    numbers = isinstance(row.values[0], int) and (row.mask != -1 or row.values[0] > 255)
    values = [f"`{value:#x}`" if numbers else f"`{value}`" for value in row.values]
    means = f"{row.means}{f', for {row.after:g} s' if row.after else ''}{' ?' if row.unsure else ''}"
    of_joint = [row.joint, "sensor lost" if row.sensor else "", "see `Spare`" if row.heat else ""]
    arm = "" if row.well else row.arm.replace("_", " ")
    steps = f"*{row.recovery}*" if row.recovery else ""
    return _row(", ".join(values), means, " and ".join(filter(None, of_joint)), arm, steps)


def _command_line() -> str:
    lines = ["# Commands", "", "What `ftqp COMMAND --help` says; [files and exit codes](../command-line.md)."]
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        lines += ["", f"## ftqp {name}", "", command.help or ""]
        rows = [_option(one) for one in command.params if not getattr(one, "hidden", False)]
        lines += ["", *_head("argument or option", "meaning"), *rows]
        if command.epilog:
            lines += ["", f"    {command.epilog.removeprefix('Example: ')}"]
    return "\n".join(lines) + "\n"


def _option(one: Any) -> str:
    """An argument or option of a command as a row."""
    if one.param_type_name == "argument":
        name = one.metavar or one.name.upper()
    else:
        value = "" if one.is_flag else f" {one.metavar or one.type.name.upper()}"
        name = f"{', '.join(one.opts)}{value}"
    told = isinstance(one.default, str | int | float) and not isinstance(one.default, bool)
    return _row(f"`{name}`", (one.help or "") + (f" Default: `{one.default}`." if told else ""))


def _head(*titles: str) -> list[str]:
    return [_row(*titles), "|---" * len(titles) + "|"]


def _row(*cells: str) -> str:
    """A row of a table; code stays as it is, in other cells < is no tag."""
    plain = [cell if cell.startswith("`") else cell.replace("<", "&lt;") for cell in cells]
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in plain) + " |"
