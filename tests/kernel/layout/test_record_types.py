"""No record begins as another one does: numba would take it for a kind of that, with a warning."""

from itertools import permutations

from ftqp.kernel.layout.detection_room import detection_dtype
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
