"""Thin bone that a scan does not show is found as a sheet between two air spaces, and its border is that of the air."""

from __future__ import annotations

import numpy as np
import pytest

from head_phantom.generate import generate_fields
from head_phantom.scanned import FINE_MM, scanned
from vfix_engine.anatomy.islands import islands
from vfix_engine.anatomy.segmentation import PRESETS, SegmentRequest
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.tissue_regions import near_air, sheets_between_air
from vfix_engine.files.volume import BONE_HU, Volume

BOX = ((-2.0, 26.0, 12.0), (17.0, 40.0, 32.0))  # middle turbinate and septum, and the air on both sides


def in_a_body(part: Volume) -> Volume:
    """The part within tissue all round, as it is in a head."""
    wide = int(np.ceil(12.0 / part.spacing.min()))
    hu = np.pad(part.hu, wide, constant_values=40)
    hu = np.pad(hu, ((0, 0), (30, 30), (30, 30)), constant_values=-1000)
    origin = part.index_to_lps([-wide - 30.0, -wide - 30.0, -float(wide)])
    return Volume(hu, origin, part.spacing, part.direction)


@pytest.mark.parametrize("slice_mm", [1.0, 2.0])
def test_sheets_that_a_threshold_of_bone_loses_are_found_between_two_airs(slice_mm: float) -> None:
    distance, origin = generate_fields(FINE_MM, lambda tissues, _: tissues.thin_bone, BOX)
    middle = np.argwhere(distance < -0.4)
    middle = middle[((middle >= 16) & (middle < np.array(distance.shape) - 16)).all(axis=1)]
    places = middle[:, ::-1] * FINE_MM + origin
    ct = in_a_body(scanned(BOX, (0.5, 0.5, slice_mm), 1.0, 0.7))
    found = islands(ct, SegmentRequest(PRESETS["unseen_bone"])).mask
    index = np.rint(ct.lps_to_index(places)).astype(int)
    i, j, k = index.T
    hu = ct.hu[k, j, i]
    lost = (hu >= TISSUE_HU) & (hu < BONE_HU)
    assert lost.mean() > 0.75
    share = found[k, j, i][lost].mean()
    assert share > 0.6, "the rest ends in a wall, or is thicker with its mucosa"


def test_a_sheet_is_found_up_to_its_bound_and_a_wall_is_not() -> None:
    hu = np.full((40, 60, 60), 40, dtype=np.int16)
    hu[:, :8], hu[:, -8:] = -1000, -1000
    hu[8:32, 20:40, 20:40] = -1000
    hu[8:32, 20:40, 25:27] = 60  # a sheet of 2 mm
    hu[8:32, 20:40, 32:37] = 60  # a wall of 5 mm
    volume = Volume(hu, np.zeros(3), np.ones(3), np.eye(3))
    found = sheets_between_air(volume, 3.0)
    assert found[14:26, 25:35, 25:27].all()
    assert not found[14:26, 25:35, 32:37].any()
    assert not found[:8].any()
    assert not found[:, :8].any(), "the room's air is no airway"
    near = near_air(volume, 3.0)
    assert near[20, 30, 17]
    assert not near[20, 30, 14]
