"""The recipe for conda and the release workflow say what pyproject.toml says."""

import re
import tomllib
from pathlib import Path

import pytest

import ftqp

yaml = pytest.importorskip("yaml", reason='needs PyYAML (pip install -e ".[docs]")')
ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OTHER_NAMES = {"pin": "pinocchio"}
"""What conda-forge calls them."""


def recipe():
    """The recipe with its placeholders filled in."""
    text = (ROOT / "recipe" / "meta.yaml").read_text(encoding="utf-8")
    for placeholder, value in (('{{ compiler("c") }}', "c-compiler"), ("{{ PYTHON }}", "python")):
        text = text.replace(placeholder, value)
    return yaml.safe_load(re.sub(r"\{\{.*?\}\}", "", text))


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


def test_the_release_makes_wheels_for_both_architectures_and_tries_them():
    found = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8"))
    wheels = found["jobs"]["wheels"]
    machines = [one["machine"] for one in wheels["strategy"]["matrix"]["include"]]
    assert len(machines) == 2 and any(machine.endswith("-arm") for machine in machines)
    commands = " ".join(step.get("run", "") for step in wheels["steps"])
    assert "make wheel " in commands and 'ftqp" doctor' in commands
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.search(r"^wheel:", makefile, re.M) and re.search(r"^wheels:", makefile, re.M)
