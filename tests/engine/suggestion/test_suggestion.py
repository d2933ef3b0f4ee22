"""Suggested ways in a made-up head: a bent channel of air through bone with a soft lining, with and without a lid."""

from functools import cache

import numpy as np
import pytest

from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.fields.distance_field import DistanceField, FieldGrid
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.suggestion import NoWay, Room, SearchSpace, smoothed, suggest_path, widest_way

LOW, HIGH = np.array([-20.0, -70.0, -20.0]), np.array([20.0, 60.0, 40.0])
ENTRY, TARGET = np.array([0.0, -10.0, 0.0]), np.array([0.0, 50.0, 9.0])
BONE_HU, SKIN_HU, AIR_HU = 1000.0, 40.0, -1000.0
SETTINGS = ControlSettings()


def centre(y: np.ndarray) -> np.ndarray:
    """Height of the channel's middle: it rises behind y = 10."""
    return np.where(y > 10.0, 0.2 * (y - 10.0) + 0.0006 * (y - 10.0) ** 2, 0.0)


def from_middle(points: np.ndarray) -> np.ndarray:
    return np.hypot(points[:, 0], points[:, 2] - centre(points[:, 1]))


def hounsfield(points: np.ndarray, lid: bool) -> np.ndarray:
    """A channel of 5 mm radius in bone, lined with 1 mm of mucosa, that begins in air at y = 0."""
    r, y = from_middle(points), points[:, 1]
    hu = np.where(r < 5.0, AIR_HU, np.where(r < 6.0, SKIN_HU, BONE_HU))
    if lid:
        hu = np.where((y > 28.0) & (y < 32.0), BONE_HU, hu)
    return np.where(y < 0.0, AIR_HU, hu)


@cache
def surroundings(lid: bool = False) -> SearchSpace:
    step = 0.5
    counts = ((HIGH - LOW) / step).astype(int) + 1
    k, j, i = np.indices(counts[::-1]).reshape(3, -1)
    hu = hounsfield(LOW + step * np.column_stack([i, j, k]), lid).reshape(counts[::-1])
    volume = Volume(hu.astype(np.int16), LOW, np.full(3, step), np.eye(3))
    fields = [_field(hu, threshold, step) for threshold in (250.0, -300.0)]
    return SearchSpace(ProximityTree(extract_surface(volume, 250.0)), Room(*fields))


def _field(hu: np.ndarray, threshold: float, step: float) -> DistanceField:
    from scipy.ndimage import distance_transform_edt

    inside = hu > threshold
    signed = distance_transform_edt(~inside) - distance_transform_edt(inside)
    return DistanceField([FieldGrid((signed * step).astype(np.float32), LOW, step)])


def test_the_way_of_the_tip_keeps_to_the_middle() -> None:
    way = widest_way(surroundings().room, ENTRY, TARGET, 1.0, 0.3)
    assert way.reached
    assert way.in_the_way == ""
    assert way.places[0] == pytest.approx(ENTRY)
    assert way.places[-1] == pytest.approx(TARGET)
    inside = way.places[way.places[:, 1] > 1.0]
    assert from_middle(inside).max() < 1.6
    points = smoothed(way.places)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 8.0
    assert from_middle(SplinePath(points).position(np.linspace(12.0, 55.0, 50))).max() < 1.8


def test_a_way_that_bone_closes_ends_before_it() -> None:
    way = widest_way(surroundings(lid=True).room, ENTRY, TARGET, 1.0, 0.3)
    assert not way.reached
    assert way.in_the_way == "bone"
    assert 22.0 < way.places[-1][1] < 28.0
    assert way.gap_mm == pytest.approx(float(np.linalg.norm(way.places[-1] - TARGET)))


@pytest.mark.parametrize("entry", [[0.0, 20.0, -12.0], [0.0, -69.0, 300.0]])
def test_an_entry_that_is_not_in_air_is_refused(entry: list[float]) -> None:
    with pytest.raises(InputError, match="entry"):
        widest_way(surroundings().room, entry, TARGET, 1.0, 0.3)


@pytest.mark.parametrize("name", ["straight_pointer", "bent_30"])
def test_suggested_paths_arrive_and_are_driven_as_they_were_planned(name: str) -> None:
    around, tool = surroundings(), Tool.load(name)
    told = list[tuple[str, float]]()
    found = suggest_path(
        around, RobotModel.load("steady_hand"), tool, ENTRY, TARGET, SETTINGS, lambda *now: told.append(now)
    )
    assert found.none is None
    best = found.alternatives[0]
    assert best.run.completed
    assert best.least_clearance_mm >= SETTINGS.margin_mm - 1e-3
    assert best.directions.shape == best.points.shape
    assert (best.rolls is None) == (name == "straight_pointer")
    assert np.linalg.norm(best.directions, axis=1) == pytest.approx(1.0)
    stages, fractions = zip(*told, strict=True)
    assert any("Simulating way 2" in stage for stage in stages)
    assert list(fractions) == sorted(fractions), "progress never goes back"
    assert len(set(fractions)) > 15
    # A straight tool lies along the channel: its lining is pressed by no more than it is thick.
    assert best.passage.tissue_depth_mm is not None
    assert best.passage.tissue_depth_mm < 3.5


def test_where_there_is_no_way_the_place_and_the_search_are_told() -> None:
    tool = Tool.load("straight_pointer")
    found = suggest_path(surroundings(lid=True), RobotModel.load("steady_hand"), tool, ENTRY, TARGET, SETTINGS)
    assert found.alternatives == ()
    assert isinstance(found.none, NoWay)
    assert "bone" in found.none.reason
    assert "entry and target" in found.none.searched
    assert found.none.ends_at[1] < 28.0


def test_a_target_in_bone_is_reported_as_that() -> None:
    around = surroundings(lid=True)
    y = np.linspace(20.0, 60.0, 81)
    line = np.column_stack([np.full_like(y, ENTRY[0]), y, np.full_like(y, ENTRY[2])])
    deepest = line[np.nanargmin(around.room.bone.at(line))]
    found = suggest_path(
        around, RobotModel.load("steady_hand"), Tool.load("straight_pointer"), ENTRY, deepest, SETTINGS
    )
    assert found.none is not None
    assert found.none.short == "the target lies in bone"


def test_what_is_raised_while_it_searches_ends_it() -> None:
    class Stop(Exception):
        pass

    def tell(stage: str, share: float) -> None:
        if share >= 0.3:
            raise Stop

    with pytest.raises(Stop):
        suggest_path(
            surroundings(), RobotModel.load("steady_hand"), Tool.load("straight_pointer"), ENTRY, TARGET, SETTINGS, tell
        )


def test_a_tool_that_leaves_the_scan_within_tissue_is_not_known() -> None:
    tool = Tool.load("straight_pointer")
    into = np.column_stack([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # the shaft goes down through bone
    out = np.eye(3)  # and out in front, through air
    found = surroundings().room.figures(tool, np.stack([into, out]), np.array([[0.0, 5.0, 0.0], [0.0, -5.0, 0.0]]))
    assert found.unknown.tolist() == [1.0, 0.0]
    assert found.bone[0] < 0.0 < found.bone[1]
    assert found.touched[1] == 0.0


def test_fields_on_different_grids_are_refused() -> None:
    bone = surroundings().room.bone
    grid = bone.grids[0]
    other = DistanceField([FieldGrid(grid.values, grid.origin + 1.0, grid.step_mm)])
    with pytest.raises(InputError, match="same grids"):
        Room(bone, other)
