"""Public callables say what their arguments mean, and refuse something else in a sentence."""

import ast
import inspect
import re
import textwrap
from pathlib import Path

import numpy as np
import pytest

import ftqp
from tests.test_texts import ROOT


def arguments_of(node):
    """The parameters that the docstring of a function or class has to name; None where it is no callable."""
    if isinstance(node, ast.ClassDef):
        made = [n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__"]
        if not made:
            fields = [n for n in node.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)]
            is_data = any("dataclass" in ast.unparse(one) for one in node.decorator_list)
            return (
                [
                    n.target.id
                    for n in fields
                    if "ClassVar" not in ast.unparse(n.annotation) and not n.target.id.startswith("_")
                ]
                if is_data
                else None
            )
        node = made[0]
    elif not isinstance(node, ast.FunctionDef):
        return None
    a = node.args
    names = [one.arg for one in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
    names += [one.arg for one in (a.vararg, a.kwarg) if one is not None]
    return [name for name in names if name not in ("self", "cls")]


def entries_of(docstring, section):
    """The names in a section of a docstring; None without the section."""
    lines = docstring.splitlines()
    if f"{section}:" not in lines:
        return None
    names = []
    for line in lines[lines.index(f"{section}:") + 1 :]:
        if line and not line.startswith(" "):
            break
        found = re.match(r"    (\*{0,2}\w+(?:, \w+)*):", line)
        if found:
            names += found[1].lstrip("*").split(", ")
    return names


def public():
    """(name, object) of what users call: the package's names, its modules' functions, and methods."""
    holders = [ftqp.schemes, ftqp.bounds, ftqp.paths, ftqp.qp, ftqp.qp.dtrnn, ftqp.robots]
    found = {name: getattr(ftqp, name) for name in ftqp.__all__}
    for holder in holders:
        names = getattr(holder, "__all__", None) or [n for n in vars(holder) if not n.startswith("_")]
        for name in names:
            value = getattr(holder, name)
            home = "ftqp" if hasattr(holder, "__all__") else "ftqp.control.task"
            if (inspect.isclass(value) or inspect.isfunction(value)) and value.__module__.startswith(home):
                found[f"{holder.__name__}.{name}"] = value
    for name, value in list(found.items()):
        if inspect.isclass(value):
            for method, function in vars(value).items():
                function = getattr(function, "__func__", function)
                if inspect.isfunction(function) and not method.startswith("_"):
                    found[f"{name}.{method}"] = function
    return {
        name: value for name, value in found.items() if inspect.isclass(value) or inspect.isfunction(value)
    }


def in_scope(value):
    file = Path(inspect.getsourcefile(value))
    return file.is_relative_to(ROOT)


def test_every_public_callable_says_what_each_of_its_arguments_means():
    wrong = []
    for name, value in sorted(public().items()):
        if not in_scope(value) or (inspect.isclass(value) and issubclass(value, Exception)):
            continue
        tree = ast.parse(textwrap.dedent(inspect.getsource(value)))
        real, text = arguments_of(tree.body[0]), inspect.getdoc(value) or ""
        if hasattr(
            getattr(value, "__init__", None), "__signature__"
        ):  # what stands there is not what it takes
            real = list(inspect.signature(value).parameters)
        named = entries_of(text, "Args") or entries_of(text, "Attributes") or []
        if not text or (real and not set(real) <= set(named)):
            wrong.append(f"{name}: {sorted(set(real or []) - set(named)) or 'no docstring'}")
    assert not wrong


def test_every_public_property_says_what_it_is():
    """Attributes that are computed are texts of the reference, as methods are."""
    wrong = []
    for name, value in sorted(public().items()):
        if inspect.isclass(value) and in_scope(value):
            for attribute, found in vars(value).items():
                if (
                    isinstance(found, property)
                    and not attribute.startswith("_")
                    and not inspect.getdoc(found)
                ):
                    wrong.append(f"{name}.{attribute}")
    assert not wrong


PANDA = ftqp.robots.load("panda")
CIRCLE = ftqp.paths.Circle(np.eye(4), 0.1, duration=1.0)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda x: ftqp.Planner(x), "robot is {}, expected an ftqp.Robot, for example ftqp.robots.load"),
        (lambda x: ftqp.Planner(PANDA, task=x), "task is {}, expected an ftqp.Task or None"),
        (lambda x: ftqp.Planner(PANDA, emergency=x), "emergency is {}, expected an ftqp.EmergencyStop"),
        (lambda x: ftqp.Planner(PANDA, branch_limits=x), "branch_limits is {}, expected joints with their"),
        (lambda x: ftqp.PathFollower(x, CIRCLE), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.InertialTask(x), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.GoTo(x, q=np.zeros(7)), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.TargetFollower(x), "planner is {}, expected an ftqp.Planner"),
        (lambda x: ftqp.Simulation(ftqp.Planner(PANDA), x, q=np.zeros(7)), "path is {}, expected a path of"),
        (lambda x: ftqp.KinematicPlant(x, 1e-3), "robot is {}, expected an ftqp.Robot"),
        (lambda x: ftqp.Schedule([x]), "an event is {}, expected an ftqp.FaultEvent"),
        (
            lambda x: ftqp.Robot.from_pinocchio(x),
            "model is {}, expected a pinocchio.Model; files",
        ),
    ],
)
@pytest.mark.parametrize("given", ["panda", 7])
def test_something_else_is_refused_with_what_is_expected(call, sentence, given):
    with pytest.raises(ftqp.InputError, match=sentence.format(repr(given)).replace("(", r"\(")):
        call(given)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: ftqp.PathFollower(ftqp.Planner(PANDA), 1), "path is 1, expected a path of ftqp.paths"),
        (lambda: ftqp.Schedule(3), "events is 3, expected a list of ftqp.FaultEvent"),
        (lambda: ftqp.Task(rows=3), "rows is 3, expected pose, position, position_axis or names of rows"),
        (lambda: ftqp.load_scenario(3), "source is 3, expected the path of a scenario or the name"),
        (lambda: ftqp.load_log(None), "path is None, expected the path of a log or of the folder of a run"),
    ],
)  # fmt: skip
def test_the_second_and_others_too(call, sentence):
    with pytest.raises(ftqp.FtqpError, match=sentence):
        call()
