"""The measured state and the limits of a planner's record have few writers."""

import ast

import written_fields
from written_fields import Function, writers


def test_measured_state_is_not_lent():
    """Whoever asks how the arm would be elsewhere writes the supposed state; limits have their one way in."""
    found = writers()
    assert len(found["state.q"]) <= 3 and len(found["state.v"]) <= 5
    assert len(found["qp.lb"]) == len(found["qp.ub"]) == 1


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
