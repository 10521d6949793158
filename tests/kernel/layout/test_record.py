"""The record means the same to compiled code and to plain Python."""

import numpy as np
import pytest

from ftqp.kernel.active_set import standalone
from ftqp.kernel.closed_forms import reduced_problem as reduced
from ftqp.kernel.layout import record


@pytest.mark.parametrize("dtype", [record.DTYPE, reduced.DTYPE, standalone.DTYPE])
def test_no_field_is_hidden_by_an_attribute_of_numpy_s_records(dtype: np.dtype) -> None:
    # K.base would be the owner of the memory in plain Python, and the field in compiled code
    assert not set(dtype.names) & set(dir(np.record))
