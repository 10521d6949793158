"""What ``import ftqp`` gives and does not load, and what the package holds."""

import ast
import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import pytest

import ftqp


@pytest.mark.parametrize("name", ftqp.__all__)
def test_every_exported_name_can_be_used(name):
    assert getattr(ftqp, name) is not None


def test_dir_lists_exactly_the_exported_names():
    assert dir(ftqp) == sorted(ftqp.__all__)


def test_a_name_that_keeps_its_own_is_re_exported_to_type_checkers():
    """A stub gives on what it imports `as` the same name; others are Any to a type checker."""
    tree = ast.parse(Path(ftqp.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    aliases = [one for node in tree.body if isinstance(node, ast.ImportFrom) for one in node.names]
    assert {one.asname for one in aliases if one.asname} == {*ftqp.__all__} - {"__version__"}
    assert {one.asname for one in aliases if one.asname not in (one.name, None)} == {
        "load_scenario",
        "robots",
    }


def test_unknown_attribute_is_an_attribute_error_that_names_it():
    with pytest.raises(AttributeError, match="module 'ftqp' has no attribute 'Plannner'"):
        _ = ftqp.Plannner
    assert not hasattr(ftqp, "nothing")


def python(code):
    """What a fresh interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_import_loads_numpy_only():
    heavy = ["numba", "llvmlite", "pinocchio", "scipy", "osqp", "proxsuite", "daqp", "qpsolvers"]
    heavy += ["quadprog", "matplotlib", "mujoco", "pydantic", "typer", "rich"]
    assert python(f"import ftqp, sys; print([n for n in {heavy} if n in sys.modules])") == "[]"


def test_help_of_the_command_line_loads_no_arm_and_no_compiler():
    heavy = [
        "numba",
        "pinocchio",
        "scipy",
        "osqp",
        "matplotlib",
        "mujoco",
        "viser",
        "distributed",
    ]
    code = f"import ftqp.app.commands.cli, sys; print([n for n in {heavy} if n in sys.modules])"
    assert python(code) == "[]"


def test_faults_tasks_and_targets_need_no_compiler_and_no_pinocchio():
    code = (
        "import ftqp, sys; ftqp.Locked(0); ftqp.Task(); ftqp.schemes.mvn(); ftqp.EmergencyStop(); "
        "print([n for n in ('pinocchio', 'osqp', 'matplotlib') if n in sys.modules])"
    )
    assert python(code) == "[]"


def test_first_step_loads_the_arm_and_the_compiled_kernel_and_no_scipy():
    code = (
        "import ftqp, sys; arm = ftqp.robots.load('panda'); planner = ftqp.Planner(arm, 1e-3); "
        "planner.reset(arm.neutral); target = ftqp.Target(pose=arm.pose(arm.neutral)); "
        "planner.step(arm.neutral, 0.0 * arm.neutral, target); "
        "print([n for n in ('scipy', 'osqp', 'matplotlib', 'pydantic') if n in sys.modules])"
    )
    assert python(code) == "[]"


def test_star_import_gives_the_exported_names():
    names = python("from ftqp import *; print(sorted(n for n in dir() if not n.startswith('_')))")
    assert names == str(sorted(n for n in ftqp.__all__ if not n.startswith("_")))


FIXED = ("__init__.py", "__main__.py")
"""Names that Python gives to files."""


def test_a_file_name_occurs_once():
    files = [file for file in Path(ftqp.__file__).parent.rglob("*.py") if file.name not in FIXED]
    counts = Counter(file.name for file in files)
    assert len(files) > 100 and [name for name, count in counts.items() if count > 1] == []


ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OTHER_NAMES = {"pin": "pinocchio"}
"""What conda-forge calls them."""


def loaded(text):
    """What a text in YAML says."""
    yaml = pytest.importorskip("yaml", reason='needs PyYAML (pip install -e ".[docs]")')
    return yaml.safe_load(text)


def recipe():
    """The recipe with its placeholders filled in."""
    text = (ROOT / "recipe" / "meta.yaml").read_text(encoding="utf-8")
    for placeholder, value in (('{{ compiler("c") }}', "c-compiler"), ("{{ PYTHON }}", "python")):
        text = text.replace(placeholder, value)
    return loaded(re.sub(r"\{\{.*?\}\}", "", text))


def asked(line):
    """Name and oldest version of a requirement."""
    name, version = re.match(r"([\w.-]+)\s*>=\s*([\d.]+)", line).groups()
    return OTHER_NAMES.get(name, name), version


def test_the_recipe_needs_what_the_project_needs():
    found = recipe()
    wanted = {asked(line) for line in PROJECT["dependencies"]} | {("python", "3.11")}
    assert {asked(line) for line in found["requirements"]["run"]} == wanted
    assert found["package"] == {"name": PROJECT["name"], "version": ftqp.__version__}
    assert found["build"]["entry_points"] == [f"ftqp = {PROJECT['scripts']['ftqp']}"]
    assert found["about"]["license"] == PROJECT["license"]
    assert PROJECT["requires-python"] == ">=3.11"
