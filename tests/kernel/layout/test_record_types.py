"""What types of records may not be: the begin of another one, or with fields out of reach of plain Python."""

from itertools import permutations

import numpy as np
import pytest

from ftqp.kernel.layout.continuation_room import continuation_dtype
from ftqp.kernel.layout.detection_room import detection_dtype
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.law_room import law_dtype
from ftqp.kernel.layout.plan_memory import plan_dtype
from ftqp.kernel.layout.record import (
    CAPACITIES,
    arm_dtype,
    base_dtype,
    belief_dtype,
    joints_dtype,
    path_dtype,
    record_dtype,
)
from ftqp.kernel.layout.study_room import study_dtype

TYPES = {
    function.__name__: function
    for function in (
        arm_dtype, base_dtype, belief_dtype, detection_dtype, joints_dtype, law_dtype, path_dtype,
        record_dtype, study_dtype,
    )
} | {"plan_dtype": lambda capacity: plan_dtype()}  # fmt: skip


def test_no_record_begins_with_all_fields_of_another_one() -> None:
    for capacity in CAPACITIES:
        fields = {name: list(make(capacity).fields.items()) for name, make in TYPES.items()}
        for shorter, longer in permutations(fields, 2):
            same = fields[longer][: len(fields[shorter])] == fields[shorter]
            assert not same, f"{longer} begins as {shorter} does"


def names_of(dtype):
    """Every field of a record and of its rooms."""
    for name, (field, *_) in (dtype.fields or {}).items():
        yield name
        yield from names_of(field.base)


@pytest.mark.parametrize("name", [*TYPES, "free_dtype", "continuation_dtype"])
def test_no_field_has_a_name_that_records_of_numpy_have_for_themselves(name):
    """In plain Python ``F.T`` would be the transpose of F, and not its field."""
    make = {**TYPES, "free_dtype": free_dtype, "continuation_dtype": continuation_dtype}[name]
    assert not [field for field in names_of(make(8)) if hasattr(np.record, field)]
