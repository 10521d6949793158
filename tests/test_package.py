"""What the package exports and loads, which version it says, and under which licences it stands."""

import ast
import importlib.metadata as metadata
import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from packaging.requirements import Requirement

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


@pytest.fixture(scope="module")
def project():
    """The file pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_version_is_the_same_everywhere():
    assert f"\nversion: {ftqp.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n## {ftqp.__version__}\n" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_extras_are_those_that_messages_name(project):
    extras = set(project["project"]["optional-dependencies"])
    assert extras == {"viz", "sim", "robots", "ros", "solvers", "build", "distributed", "docs", "dev"}


LESSER = {"qpsolvers"}
"""Packages under the LGPL that are installed by default; SECURITY.md names them."""


def installed(requirements):
    """Every package that these bring, with its distribution; markers of other systems are left out."""
    found, waiting = {}, [Requirement(text) for text in requirements]
    while waiting:
        wanted = waiting.pop()
        name = re.sub(r"[-_.]+", "-", wanted.name).lower()
        extras = wanted.extras or {""}
        if name in found or (wanted.marker and not any(wanted.marker.evaluate({"extra": e}) for e in extras)):
            continue
        found[name] = metadata.distribution(name)
        for text in found[name].requires or ():
            inner = Requirement(text)
            if not inner.marker or any(inner.marker.evaluate({"extra": e}) for e in extras):
                inner.marker = None
                waiting.append(inner)
    return found


def licence(distribution):
    """What a distribution says of its licence: the expression, else the classifiers, else the field."""
    about = distribution.metadata
    classifiers = [text for text in about.get_all("Classifier", []) if text.startswith("License ::")]
    return about.get("License-Expression") or "; ".join(classifiers) or about.get("License") or ""


def is_gpl(text):
    return bool(re.search(r"(?<!L)(?<!Lesser )\bA?GPL|(?<!Lesser )General Public License", text))


def test_gpl_is_told_from_lgpl():
    assert (
        is_gpl("GPL-2.0-or-later")
        and is_gpl("AGPL-3.0")
        and is_gpl("OSI :: GNU General Public License v3 (GPLv3)")
    )
    assert not is_gpl("LGPL-3.0-only") and not is_gpl("GNU Lesser General Public License v3 (LGPLv3)")
    assert not is_gpl("MIT")


def test_no_package_that_is_installed_by_default_is_under_the_gpl():
    texts = {name: licence(one) for name, one in installed(PROJECT["dependencies"]).items()}
    assert len(texts) > 15
    assert {name for name, text in texts.items() if is_gpl(text)} == set()


def test_packages_under_the_lgpl_are_named():
    texts = {name: licence(one) for name, one in installed(PROJECT["dependencies"]).items()}
    lesser = {name for name, text in texts.items() if re.search("LGPL|Lesser", text)}
    assert lesser == LESSER
    named = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    assert all(name in named for name in lesser)


def test_solvers_under_the_gpl_are_in_an_extra_with_their_licence_beside_them():
    lines = (ROOT / "pyproject.toml").read_text(encoding="utf-8").splitlines()
    quadprog = [line for line in lines if '"quadprog' in line and "#" in line]
    assert quadprog and all("GPL" in line for line in quadprog)
    assert not any("quadprog" in text for text in PROJECT["dependencies"])
