"""Views that compiled code takes of its arguments are the same as slices."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from vfix_engine.kernels.views import view


@numba.njit
def _copies(array, first, rows, columns):  # type: ignore[no-untyped-def]
    matrix, block = view(array, first, (rows, columns)), view(array, first, (rows, columns, 2))
    matrix[0, 0] += 1
    return matrix.copy(), block.copy(), view(array, first, (rows,)).copy()


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int32, np.int64])
@pytest.mark.parametrize(("first", "rows", "columns"), [(0, 3, 3), (7, 2, 5), (59, 1, 1), (20, 4, 1)])
def test_a_view_is_a_slice_with_a_shape(kind: type, first: int, rows: int, columns: int) -> None:
    array = np.arange(61).astype(kind)
    there = array.copy()
    matrix, block, line = _copies(array, first, rows, columns)
    view(there, first, (rows, columns))[0, 0] += 1
    np.testing.assert_array_equal(array, there)
    np.testing.assert_array_equal(matrix, there[first : first + rows * columns].reshape(rows, columns))
    np.testing.assert_array_equal(block, there[first : first + 2 * rows * columns].reshape(rows, columns, 2))
    np.testing.assert_array_equal(line, there[first : first + rows])


def test_a_view_that_python_takes_keeps_the_array_alive() -> None:
    taken = view(np.arange(12.0), 4, (2, 3))
    assert taken.base is not None
    np.testing.assert_array_equal(taken, np.arange(4.0, 10.0).reshape(2, 3))
