"""What types of records may not be: the begin of another one, or with fields out of reach of plain Python."""

from itertools import permutations

import numpy as np
import pytest

from ftqp.kernel.layout.record import KINDS, dtype
from ftqp.kernel.layout.structures import sections


def test_no_record_begins_with_all_fields_of_another_one() -> None:
    """numba takes a record that begins as another one for a kind of that."""
    fields = {kind: list(dtype(kind).fields.items()) for kind in KINDS}
    for shorter, longer in permutations(fields, 2):
        same = fields[longer][: len(fields[shorter])] == fields[shorter]
        assert not same, f"{longer} begins as {shorter} does"


def names_of(dtype):
    """Every field of a record and of its rooms."""
    for name, (field, *_) in (dtype.fields or {}).items():
        yield name
        yield from names_of(field.base)


@pytest.mark.parametrize("kind", KINDS)
def test_no_field_has_a_name_that_records_of_numpy_have_for_themselves(kind):
    """In plain Python ``F.T`` would be the transpose of F, and not its field."""
    assert not [field for field in names_of(dtype(kind, 8)) if hasattr(np.record, field)]


def test_a_line_gives_its_fields_with_their_shape_and_one_that_is_none_is_refused():
    made = sections("room  Of a test.\n    a b  f8[2*N]  what they\n        mean\n    c  i8\n", {})
    assert made["room"](4) == [("a", "f8", (8,)), ("b", "f8", (8,)), ("c", "i8")]
    with pytest.raises(ValueError, match="is no line of fields"):
        sections("room\n    a  f9\n", {})
