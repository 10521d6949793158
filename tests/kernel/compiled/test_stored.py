import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftqp.kernel.compiled.stored import is_whole, packed, unpacked

FACTS = {"entry": "step", "capacity": 8, "nogil": False}


@given(st.binary(max_size=200))
def test_what_was_packed_comes_back(code: bytes) -> None:
    assert unpacked(packed(FACTS, code), FACTS) == code


@given(st.binary(max_size=200))
def test_any_other_content_is_nothing(content: bytes) -> None:
    assert unpacked(content, FACTS) is None
    assert unpacked(packed(FACTS, b"code")[:40] + content, FACTS) is None


@pytest.mark.parametrize("other", [{"capacity": 16}, {"entry": "stop"}, {"nogil": True}, {"more": 1}])
def test_code_for_something_else_is_nothing(other: dict[str, object]) -> None:
    assert unpacked(packed(FACTS | other, b"code"), FACTS) is None


@pytest.mark.parametrize("header", ["1e999", "NaN", "{}", "[]", '"x"', "{" * 3000, "null"])
def test_odd_headers_are_nothing(header: str) -> None:
    assert unpacked(b"ftqp compiled kernel\n" + header.encode() + b"\ncode", FACTS) is None


def test_whole_file_for_something_else_is_told_from_a_damaged_one() -> None:
    other = packed(FACTS | {"capacity": 16}, b"code")
    assert is_whole(other)
    for damaged in (b"", other[:-1], other + b"x", other[:-1] + b"f", other[:40], b"x" + other):
        assert not is_whole(damaged)


def test_header_is_plain_json_for_people_to_read() -> None:
    line = packed(FACTS, b"code").split(b"\n")[1]
    assert json.loads(line)["entry"] == "step"
