"""The record means the same to compiled code and to plain Python."""

import numpy as np
import pytest

from ftqp.kernel import record, reduced, standalone


@pytest.mark.parametrize("dtype", [record.DTYPE, reduced.DTYPE, standalone.DTYPE])
def test_no_field_is_hidden_by_an_attribute_of_numpy_s_records(dtype: np.dtype) -> None:
    # K.base would be the owner of the memory in plain Python, and the field in compiled code
    assert not set(dtype.names) & set(dir(np.record))
