"""How large ftqp is: lines and files of its folders and rooms, words of its pages, imports, constants.

    python studies/house.py            # of this tree
    python studies/house.py --root DIR # of another one, for example an older checkout

Lines are those of Python files that git follows, blank ones and comments among them.
"""

import argparse
import ast
import subprocess
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
TUNED = ("ftqp.kernel", "ftqp.control", "ftqp.faults")
CORE = (*TUNED, "ftqp.model", "ftqp.qp", "ftqp.core")
SCRIPTS = ("studies", "benchmarks", "solvers", "bench")
DEEP = ("kernel", "control", "control/planner", "control/following", "app", "viz", "sim", "analysis")
"""Folders of src/ftqp whose folders are rooms of their own; other rooms are folders of src/ftqp."""
PLANNER = "ftqp.control.planner.planner"


def followed(root: Path) -> list[Path]:
    """The files that git follows and that are there, relative to root."""
    names = subprocess.run(["git", "ls-files"], cwd=root, check=True, capture_output=True, text=True).stdout
    return [Path(name) for name in names.splitlines() if (root / name).is_file()]


def lines(root: Path, files: Iterable[Path]) -> int:
    return sum(len((root / file).read_text().splitlines()) for file in files)


def room(file: Path) -> str:
    """The room of a file of src or tests: a folder of src/ftqp, or of a folder in DEEP; a folder of tests."""
    folders = file.parts[2:-1] if file.parts[0] == "src" else file.parts[:-1][:2]
    if file.parts[0] == "src" and "/".join(folders[:-1]) not in DEEP:
        folders = next(
            (folders[:k] for k in range(len(folders), 1, -1) if "/".join(folders[: k - 1]) in DEEP),
            folders[:1],
        )
    return "/".join(folders) or "(root)"


def module(file: Path) -> str:
    """ftqp.kernel.jit of src/ftqp/kernel/jit.py, and ftqp.kernel of src/ftqp/kernel/__init__.py."""
    return ".".join(file.with_suffix("").parts[1:]).removesuffix(".__init__")


def imported(tree: ast.Module, known: set[str]) -> set[str]:
    """The modules among the known that a module imports, anywhere in its text."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & known
            names |= inner or {node.module}
    return names & known


def reached(start: str, imports: dict[str, set[str]]) -> set[str]:
    """What a module imports, and what those import, and so on."""
    seen: set[str] = set()
    ways = [start]
    while ways:
        for name in imports[ways.pop()] - seen:
            seen.add(name)
            ways.append(name)
    return seen - {start}


def is_tuned(value: ast.expr | None) -> bool:
    """Whether a module-level value is a number with a point or exponent, or arithmetic with such numbers."""
    parts = list(ast.walk(value)) if value else []
    plain = (ast.Constant, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop, ast.Name, ast.expr_context)
    floats = [x for x in parts if isinstance(x, ast.Constant) and isinstance(x.value, float)]
    return bool(floats) and all(isinstance(x, plain) for x in parts)


def constants(tree: ast.Module) -> tuple[int, int]:
    """Module-level floats, and those whose docstring calls them a guess."""
    tuned = guessed = 0
    following = [*tree.body[1:], None]
    for node, after in zip(tree.body, following, strict=True):
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and is_tuned(node.value):
            tuned += 1
            said = after.value if isinstance(after, ast.Expr) else None
            guessed += isinstance(said, ast.Constant) and "guess" in str(said.value).lower()
    return tuned, guessed


def table(head: tuple[str, ...], rows: Iterable[tuple[object, ...]]) -> str:
    marks = ["---", *["---:"] * (len(head) - 1)]
    cells = [head, marks, *[[f"{x:,}" if isinstance(x, int) else str(x) for x in row] for row in rows]]
    return "\n".join("| " + " | ".join(row) + " |" for row in cells)


def house(root: Path) -> str:
    """Both tables: the whole, and the rooms of src."""
    files = followed(root)
    python = [file for file in files if file.suffix == ".py"]
    source = [file for file in python if file.parts[:2] == ("src", "ftqp")]
    trees = {module(file): ast.parse((root / file).read_text()) for file in source}
    imports = {name: imported(tree, set(trees)) for name, tree in trees.items()}
    importers = Counter(name for names in imports.values() for name in names)
    single = [name for name, count in importers.items() if count == 1]
    in_core = sum(name.startswith(CORE) for name in single)
    tuned = [constants(tree) for name, tree in trees.items() if name.startswith(TUNED)]
    pages = [file for file in files if file.suffix == ".md" and file.parts[0] in ("docs", "CHANGELOG.md")]
    words = sum(len((root / file).read_text().split()) for file in pages)
    rows: list[tuple[object, ...]] = []
    for name, folders in (("source (src)", ("src",)), ("tests", ("tests",)), (" + ".join(SCRIPTS), SCRIPTS)):
        those = [file for file in python if file.parts[0] in folders]
        rows.append((name, lines(root, those), len(those)))
    rows.append(("docs and changelog [words]", words, len(pages)))
    in_all = len(reached(PLANNER, imports))
    rows.append(("what planner.py imports: directly / in all", len(imports[PLANNER]), in_all))
    rows.append(("files that one other imports alone: core / outside", in_core, len(single) - in_core))
    counts = [sum(pair) for pair in zip(*tuned, strict=True)]
    rows.append(("tuned constants of kernel, control and faults / called a guess", *counts))
    rooms: dict[str, list[Path]] = {}
    for file in python:
        if file in source or file.parts[0] == "tests":
            rooms.setdefault(room(file), []).append(file)
    sizes = [(name, lines(root, those), len(those)) for name, those in sorted(rooms.items())]
    whole = table(("the whole", "lines or number", "files or number"), rows)
    return whole + "\n\n" + table(("room", "lines", "files"), sizes)


if __name__ == "__main__":
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--root", type=Path, default=HERE, help="the checkout to measure")
    print(house(asked.parse_args().root))
