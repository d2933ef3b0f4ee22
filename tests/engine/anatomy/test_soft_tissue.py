"""Soft tissue that a tool passes: against brute force, at the end of the scan, and on the heads."""

from pathlib import Path

import numpy as np
import pytest
from imaging_phantoms import asymmetric_volume, rotation
from scipy.ndimage import map_coordinates

from tests.engine.scenes import head_corridor, head_mesh
from vfix_engine.anatomy.phantom import load_head_ct, load_landmarks
from vfix_engine.anatomy.soft_tissue import SAMPLE_MM, TISSUE_HU, TissuePassed, surroundings, tissue_passed
from vfix_engine.control import ControlSettings
from vfix_engine.files.readers import read_volume
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.worlds.rigid.placing import place_robot

Line = tuple[np.ndarray, np.ndarray]  # starts (S, 3) and ends (S, 3) of a tool's axis, from the tip on


def block_in_air(direction: np.ndarray | None = None) -> Volume:
    """100 x 120 x 80 mm of air with a block of tissue from 30 to 60 mm along each axis of the grid."""
    hu = np.full((81, 121, 101), -1000, np.int16)
    hu[30:61, 30:61, 30:61] = 40
    return Volume(hu, [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], np.eye(3) if direction is None else direction)


def one_segment(start: tuple[float, ...], end: tuple[float, ...]) -> Line:
    return np.array([start]), np.array([end])


def brute_force(volume: Volume, line: Line, step: float = 0.001) -> float:
    """Length above the threshold by scipy's interpolation, a thousandth of a millimetre at a time."""
    total = 0.0
    inverse = np.linalg.inv(volume.transform_index_to_lps)
    last = np.array(volume.hu.shape[::-1]) - 1.0
    for a, b in zip(*line, strict=True):
        count = int(np.linalg.norm(b - a) / step)
        points = a + ((np.arange(count) + 0.5) / count)[:, None] * (b - a)
        indices = points @ inverse[:3, :3].T + inverse[:3, 3]
        within = ((indices >= 0.0) & (indices <= last)).all(axis=1)
        hu = map_coordinates(volume.hu.astype(float), indices[within][:, ::-1].T, order=1)
        total += (hu > TISSUE_HU).sum() * np.linalg.norm(b - a) / count
    return total


@pytest.mark.parametrize("direction", [np.eye(3), np.diag([1.0, 1.0, -1.0]), rotation((20.0, 10.0, -35.0))])
def test_the_length_in_tissue_is_that_of_brute_force(direction: np.ndarray) -> None:
    """Random bent tools through dense boxes, on upright, left-handed and oblique grids; partly outside the scan."""
    volume = asymmetric_volume(direction)
    random = np.random.default_rng(7)
    low, high = volume.bounds
    borders, longest = 6, 0.0
    for _ in range(20):
        places = random.uniform(low - 2.0, high + 2.0, (4, 3))
        line = places[1:], places[:-1]  # each part ends where the one before it begins
        passed = tissue_passed(volume, [(3.0, *line)])
        length = passed.length_mm or 0.0  # None where the whole tool is outside the scan
        assert length == pytest.approx(brute_force(volume, line), abs=borders * SAMPLE_MM / 2)
        longest = max(longest, length)
    assert longest > 5.0, "the tools must meet tissue"


def test_the_worst_pose_counts_and_says_where_it_is() -> None:
    volume = block_in_air()
    through, beside = one_segment((45, -20, 45), (45, 90, 45)), one_segment((10, -20, 45), (10, 90, 45))
    assert tissue_passed(volume, [(0.0, *beside), (7.5, *through), (12.0, *beside)]) == TissuePassed(
        pytest.approx(30.0 + 2 * 340 / 1040, abs=0.1), 7.5, complete=True
    )
    assert tissue_passed(volume, [(0.0, *beside)]) == TissuePassed(0.0, 0.0, complete=True)


def test_what_is_not_known_is_said() -> None:
    """Without a CT, outside of it, and where it ends in tissue beside the tool; not where it ends in free air."""
    volume = block_in_air()
    through = one_segment((45, -20, 45), (45, 90, 45))
    assert tissue_passed(None, [(0.0, *through)]) == TissuePassed()
    assert tissue_passed(volume, [(0.0, *one_segment((45, -20, 45), (45, -5, 45)))]) == TissuePassed()
    cut = Volume(volume.hu[:, 40:], [0.0, 40.0, 0.0], volume.spacing, volume.direction)  # ends in the block
    passed = tissue_passed(cut, [(0.0, *through)])
    assert passed.length_mm == pytest.approx(20.0 + 340 / 1040, abs=0.1)
    assert not passed.complete
    assert not tissue_passed(cut, [(0.0, *one_segment((20, -20, 45), (20, 90, 45)))]).complete, "10 mm beside it"
    assert tissue_passed(cut, [(0.0, *one_segment((95, -20, 45), (95, 90, 45)))]).complete, "35 mm beside it"


def test_what_a_place_lies_in() -> None:
    volume = block_in_air()
    hollow = np.array(volume.hu)
    hollow[40:50, 40:50, 40:50] = -1000
    volume = Volume(hollow, volume.origin, volume.spacing, volume.direction)
    assert surroundings(volume, [45.0, 45.0, 45.0]) == "air_inside"
    assert surroundings(volume, [34.0, 45.0, 45.0]) == "soft_tissue"
    assert surroundings(volume, [27.0, 45.0, 45.0]) == "outside_body"
    assert surroundings(volume, [-1.0, 45.0, 45.0]) == "outside_scan"
    assert surroundings(None, [0.0, 0.0, 0.0]) == "not_known"


def test_the_synthetic_heads_corridor_is_air_inside_but_for_its_entry() -> None:
    ct, corridor = load_head_ct(), load_landmarks().corridor
    told = [surroundings(ct, place.position) for place in corridor]
    assert told == ["outside_body"] + ["air_inside"] * (len(corridor) - 1)
    assert surroundings(ct, [0.0, -17.0, 17.0]) == "soft_tissue"  # the dorsum of the nose


def test_a_tool_in_the_real_nose_passes_its_tip(trial_data: Path) -> None:
    """Bone clearance is kept along the whole corridor, while the straight shaft runs through the tip of the nose."""
    ct, _ = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")
    settings, path = ControlSettings(), SplinePath(head_corridor(trial_data))
    robot, tool = RobotModel.load("steady_hand"), Tool.load("straight_pointer")
    run = place_robot(ProximityTree(head_mesh(trial_data)), robot, tool, path, settings).run
    assert run.completed
    assert run.clearance.min() >= settings.margin_mm
    passed = tissue_passed(ct, run.stations())
    assert passed.length_mm is not None
    assert 4.0 < passed.length_mm < 8.0
    assert passed.at_mm is not None
    assert passed.at_mm < 15.0, "while the tip is still in the vestibule"
    assert passed.complete, "the scan ends in the air before the face"
