"""Statuses speak to the operator and stand in the kernel's order."""

import pytest

from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.kernel.layout import enums as codes


@pytest.mark.parametrize("status", StepStatus)
def test_position_of_a_status_is_the_code_of_the_kernel(status):
    assert STATUSES[getattr(codes, status.name)] is status


@pytest.mark.parametrize("status", StepStatus)
def test_value_of_a_status_is_a_sentence(status):
    assert len(status.value.split()) >= 6 and status.value[0].islower() and not status.value.endswith(".")


@pytest.mark.parametrize("status", [StepStatus.STOPPING, StepStatus.STOPPED])
def test_stopped_arm_says_how_to_go_on(status):
    assert "reset()" in status.value
