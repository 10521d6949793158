"""A matrix in a vector's memory: the same numbers, by rows."""

import numpy as np
import pytest

from ftqp.kernel.maths.matrix_view import matrix_view


@pytest.mark.parametrize(
    ("first", "rows", "columns"), [(0, 4, 5), (3, 2, 7), (19, 1, 1), (20, 0, 4), (0, 0, 0)]
)
def test_matrix_is_the_vector_by_rows_and_writes_into_it(first, rows, columns):
    vector = np.arange(20.0)
    view = matrix_view(vector, first, rows, columns)
    assert view.shape == (rows, columns)
    assert np.array_equal(view.ravel(), np.arange(first, first + rows * columns))
    view[...] = -1.0
    assert np.all(vector[first : first + rows * columns] == -1.0) and np.all(vector[:first] >= 0.0)
