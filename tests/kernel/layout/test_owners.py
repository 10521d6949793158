"""Each field of a planner's record has an owner: one file that writes it, or a list of them and a reason."""

import ast
import tomllib
from pathlib import Path

import written_fields
from written_fields import FIELDS, Function, writers

TABLE = Path(__file__).with_name("owners.toml")
OWNERS = tomllib.loads(TABLE.read_text(encoding="utf-8"))


def table() -> dict[str, list[str]]:
    """By room.field, the files that the table names."""
    named: dict[str, list[str]] = {}
    for file, fields in OWNERS["one"].items():
        for field in fields:
            named.setdefault(field, []).append(file)
    for entry in OWNERS["several"]:
        for field in entry["fields"]:
            named.setdefault(field, []).extend(entry["writers"])
    return named


def test_each_field_is_written_by_the_files_that_the_table_names():
    found, named = writers(), table()
    wrong = [
        f"{field} is written by {found.get(field, [])}, {TABLE.name} names {named.get(field, [])}"
        for field in sorted(found.keys() | named.keys())
        if found.get(field) != named.get(field)
    ]
    assert not wrong, "find an owner for each, or name who writes it, and why:\n" + "\n".join(wrong)


def test_a_field_that_several_files_write_says_why():
    for entry in OWNERS["several"]:
        assert len(entry["writers"]) > 1 and entry["writers"] == sorted(entry["writers"])
        assert len(entry["why"].split()) > 1, entry["fields"]


def test_the_table_names_each_field_once_and_only_fields():
    fields = [field for every in OWNERS["one"].values() for field in every]
    fields += [field for entry in OWNERS["several"] for field in entry["fields"]]
    assert len(fields) == len(set(fields))
    assert set(fields) <= {f"{room}.{field}" for room, every in FIELDS.items() for field in every}


def test_measured_state_is_not_lent():
    """Whoever asks how the arm would be elsewhere writes the supposed state; limits have their one way in."""
    found = writers()
    assert len(found["state.q"]) <= 3 and len(found["state.v"]) <= 5
    assert len(found["qp.lb"]) == len(found["qp.ub"]) == 2


def test_a_write_is_seen_however_it_is_written():
    for body in (
        "K.state.q[i] = 1.0", "state.q[i] += 1.0", "put(state.q, at, x)", "state.v[i], state.q[i] = 1.0, 2.0",
        "q = K.state.q\n    q[i] = 1.0", "a, q = 1.0, state.q\n    q[i] = a",
    ):  # fmt: skip
        node = ast.parse(f"def f(K, state, i, at, x):\n    {body}").body[0]
        assert isinstance(node, ast.FunctionDef)
        function = Function(node)
        for call in function.calls:
            for place in written_fields.PUTS[call.func.id]:
                function.write(call.args[place])
        assert ("state", "q") in function.fields, body
    node = ast.parse("def f(row, K):\n    row[0] = K.state.q[0]\n    x = K.state.q[1]").body[0]
    assert isinstance(node, ast.FunctionDef)
    assert Function(node).written == {0} and not Function(node).fields
