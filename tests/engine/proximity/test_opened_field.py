"""A distance field without what is taken away."""

import numpy as np

from vfix_engine.geometry.shapes import Box, Sphere
from vfix_engine.proximity.fields.distance_field import DistanceField, FieldGrid
from vfix_engine.proximity.fields.opened_field import opened_field


def ground() -> DistanceField:
    """Solid below z = 10 mm, on a grid whose axes have different lengths; one corner is not known."""
    z = np.arange(41)[:, None, None] * 0.5
    values = (z - 10.0) * np.ones((1, 31, 51))
    values[:4, :4, :4] = np.nan
    return DistanceField([FieldGrid(values.astype(np.float32), np.array([1.0, -2.0, 0.0]), 0.5)])


def test_what_is_taken_away_is_outside_by_its_depth() -> None:
    sphere = Sphere([12.0, 5.0, 10.0], 3.0)
    field = opened_field(ground(), (sphere,))
    points = np.array([[12.0, 5.0, 9.0], [12.0, 5.0, 7.5], [12.0, 5.0, 6.0], [20.0, 8.0, 5.0], [12.0, 5.0, 15.0]])
    np.testing.assert_allclose(field.at(points), [2.0, 0.5, -1.0, -5.0, 5.0], atol=0.06)
    assert np.isnan(field.at([[1.2, -1.8, 0.3]])).all(), "what is not known stays so"


def test_no_shape_and_one_far_away_change_nothing() -> None:
    field = ground()
    assert opened_field(field, ()) is field
    far = opened_field(field, (Box(np.eye(4) + np.pad([[0.0], [0.0], [200.0]], ((0, 1), (3, 0))), [1.0, 1.0, 1.0]),))
    np.testing.assert_array_equal(far.grids[0].values, field.grids[0].values)
