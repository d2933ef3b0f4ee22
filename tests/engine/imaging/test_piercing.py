"""Ways round tissue in a made-up head: two cavities open to the room, a wall between them, and skin around (HAZ-36)."""

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from vfix_engine.geometry.opened_field import opened_field
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.geometry.tool_depth import tool_depth
from vfix_engine.imaging.piercing import GIVES_AT_ENTRY_MM, PoseWays, SidewaysColumn, Ways, piercing_of
from vfix_engine.imaging.readers import read_volume
from vfix_engine.imaging.room_air import padding, room_air
from vfix_engine.imaging.solids import refined_solid, solid_of_volumes
from vfix_engine.imaging.volume import Volume
from vfix_engine.imaging.way_round_kernel import UNKNOWN

AIR_HU, SKIN_HU, PADDING_HU = -1000, 40, -2000
LOW, HIGH = np.array([-42.0, -36.0, -30.0]), np.array([42.0, 56.0, 42.0])
FOCUS = np.array([[-14.0, -12.0, -12.0], [14.0, 50.0, 14.0]])
ENTRY = np.array([6.0, -2.0, 0.0])
STRAIGHT = np.array([0.0, -1.0, 0.0])
TILT = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(np.pi / 6), -0.5], [0.0, 0.5, np.cos(np.pi / 6)]])


def hounsfield(points: np.ndarray) -> np.ndarray:
    """Tissue behind y = 0, 56 mm wide, with a cavity of 9 x 12 mm on both sides of a wall of 3 mm."""
    x, y, z = points.T
    body = (y > 0.0) & (np.abs(x) < 28.0) & (z < 30.0)
    cavity = (np.abs(x) > 1.5) & (np.abs(x) < 10.5) & (np.abs(z) < 6.0) & (y < 52.0)
    return np.where(body & ~cavity, SKIN_HU, AIR_HU)


@cache
def volume(storage: str = "axial", step: float = 1.0) -> Volume:
    """The head, whose voxels lie along the axes, in another order, or tilted by 30° with padding around it."""
    directions = {"axial": np.eye(3), "coronal": np.eye(3)[:, [0, 2, 1]], "sagittal": np.eye(3)[:, [1, 2, 0]]}
    direction = TILT if storage == "tilted" else directions[storage]
    middle, half = 0.5 * (LOW + HIGH), 0.5 * (HIGH - LOW)
    extent = 1.25 * half if storage == "tilted" else np.abs(direction.T @ half)
    counts = np.floor(2.0 * extent / step).astype(int) + 1
    k, j, i = np.indices(counts[::-1]).reshape(3, -1)
    origin = middle - direction @ extent
    hu = np.zeros(len(i))
    for shift in (-0.25, 0.25):  # partial volume
        places = origin + step * (np.column_stack([i, j, k]) + shift) @ direction.T
        hu += 0.5 * hounsfield(places)
    if storage == "tilted":
        places = origin + step * np.column_stack([i, j, k]) @ direction.T
        hu[((places < LOW - 0.1) | (places > HIGH + 0.1)).any(axis=1)] = PADDING_HU
    return Volume(hu.reshape(counts[::-1]).astype(np.int16), origin, np.full(3, step), direction)


def ways_in(scan: Volume, entry: np.ndarray = ENTRY, threshold: float = -300.0) -> Ways:
    tissue = refined_solid(solid_of_volumes([scan], threshold), [scan], threshold, FOCUS)
    return Ways(tissue, room_air(tissue, [scan]), entry)


@cache
def head() -> Ways:
    return ways_in(volume())


def judged(ways: Ways, tip: tuple[float, float, float], through: tuple[float, float, float]) -> PoseWays:
    """A straight tool of 90 mm whose axis passes a place."""
    at = np.array(tip)
    ahead = np.array(through) - at
    return ways.of_pose((at + 90.0 * ahead / np.linalg.norm(ahead))[None], at[None])


def kinds(pose: PoseWays) -> list[tuple[str, str, bool]]:
    return [(run.outside, run.inside, run.pierced) for run in pose.runs]


# Shafts by a tip and a place that they pass, with what they pierce: the ends of each run, from outside to inside.
SHAFTS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float], list[tuple[str, str, bool]]]] = {
    "nostril": ((6.0, 40.0, 0.0), (6.0, 0.0, 0.0), []),
    "rim of the nostril": ((6.0, 40.0, -2.0), (6.0, 8.0, 6.5), [("room", "body", False)]),
    "front": ((-6.0, 30.0, 0.0), (-16.0, 0.0, 14.0), [("room", "body", True)]),
    "side": ((6.0, 25.0, 0.0), (28.0, 15.0, 0.0), [("room", "body", True)]),
    "wall": ((-6.0, 42.0, 0.0), (0.0, 24.0, 0.0), [("body", "body", True)]),
    "tip in the skin": ((16.0, 14.0, -20.0), (16.0, 0.0, -20.0), [("room", "tip", True)]),
    "tip on the skin": ((16.0, 2.0, -20.0), (16.0, 0.0, -20.0), [("room", "tip", False)]),
}


@pytest.mark.parametrize("shaft", SHAFTS)
def test_what_a_shaft_pierces_in_the_made_up_head(shaft: str) -> None:
    tip, through, expected = SHAFTS[shaft]
    pose = judged(head(), tip, through)
    assert kinds(pose) == expected
    assert pose.known


@pytest.mark.parametrize(("storage", "step"), [("coronal", 1.2), ("sagittal", 1.2), ("tilted", 1.0), ("axial", 2.0)])
def test_how_a_scan_is_stored_changes_no_verdict(storage: str, step: float) -> None:
    ways = ways_in(volume(storage, step))
    for name, (tip, through, expected) in SHAFTS.items():
        pose = judged(ways, tip, through)
        assert kinds(pose) == expected, name
        assert pose.known
        for one, other in zip(pose.runs, judged(head(), tip, through).runs, strict=True):
            assert one.sideways_mm == pytest.approx(other.sideways_mm, abs=1.5)


def brute_force(tip: np.ndarray, ahead: np.ndarray, first: float, last: float) -> float:
    """The same by labels of air on a grid along the tool, cylinder by cylinder; the air is measured, not a field."""
    step, most = 0.4, 15.0
    across = np.arange(-most - 1.2, most + 1.2 + step / 2, step)
    u = np.cross(ahead, [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    along = np.arange(first - most - 9.0, last + most + 9.0, step)
    s, a, b = np.meshgrid(along, across, across, indexing="ij")
    places = tip + s[..., None] * ahead + a[..., None] * u + b[..., None] * np.cross(ahead, u)
    air = volume().sample(places.reshape(-1, 3)).reshape(s.shape) < -300.0
    wide = ndimage.distance_transform_edt(air, sampling=step) >= 1.0
    away, middle = np.hypot(a, b), len(across) // 2
    outer, inner = np.abs(s - last - 3.0) < 1.0, np.abs(s - first + 3.0) < 1.0
    beside = (np.abs(a) < 1.5) & (np.abs(b) < 1.5)
    assert wide[:, middle, middle].any()
    for limit in np.arange(0.0, most + 1.0, 0.2):
        labels, _ = ndimage.label(wide & (away <= limit))
        if np.intersect1d(labels[outer & beside & (labels > 0)], labels[inner & beside & (labels > 0)]).size:
            return float(limit) - 1.0
    return float("inf")


@pytest.mark.parametrize("shaft", ["rim of the nostril", "wall"])
def test_the_distance_is_that_of_brute_force(shaft: str) -> None:
    tip, through, _ = SHAFTS[shaft]
    (run,) = judged(head(), tip, through).runs
    ahead = np.array(through) - tip
    ahead /= np.linalg.norm(ahead)
    first, last = (float((np.array(place) - tip) @ ahead) for place in (run.end, run.begin))
    assert run.sideways_mm is not None
    expected = brute_force(np.array(tip), ahead, first, last)
    assert run.sideways_mm == pytest.approx(expected, abs=0.8) or run.sideways_mm == expected
    assert np.isfinite(expected) or shaft == "wall"


@pytest.mark.parametrize("threshold", [-500.0, -100.0])
def test_the_threshold_of_tissue_moves_the_distance_little(threshold: float) -> None:
    tip, through, _ = SHAFTS["rim of the nostril"]
    (run,), (other,) = (
        judged(head(), tip, through).runs,
        judged(ways_in(volume(), threshold=threshold), tip, through).runs,
    )
    assert run.sideways_mm == pytest.approx(other.sideways_mm, abs=1.5)


@pytest.mark.parametrize(
    ("radius", "place", "pierced"), [(3.0, (27.0, 0.0), False), (0.7, (24.0, 3.0), True), (1.7, (50.0, 0.0), True)]
)
def test_a_hole_in_the_wall_leads_round_it_where_it_is_near_and_wide(
    radius: float, place: tuple[float, float], pierced: bool
) -> None:
    scan = volume()
    hu = np.array(scan.hu)
    k, j, i = np.indices(hu.shape)
    x, y, z = scan.index_to_lps(np.column_stack([i.ravel(), j.ravel(), k.ravel()])).T
    hole = (np.abs(x) < 2.5) & (np.hypot(y - place[0], z - place[1]) < radius)
    hu[hole.reshape(hu.shape)] = AIR_HU
    tip, through, _ = SHAFTS["wall"]
    pose = judged(ways_in(Volume(hu, scan.origin, scan.spacing, scan.direction)), tip, through)
    assert kinds(pose) == ([("body", "body", True)] if pierced else [("body", "body", False)])


@pytest.mark.parametrize(("radius", "pierced"), [(0.75, False), (2.0, False)])
def test_the_axis_of_a_tool_is_judged_whatever_its_width(radius: float, pierced: bool) -> None:
    """Through a nostril of 3 mm, which is narrower than the wider tool: its depth in tissue is told, no piercing."""
    scan = volume()
    k, j, i = np.indices(scan.hu.shape)
    x, y, z = scan.index_to_lps(np.column_stack([i.ravel(), j.ravel(), k.ravel()])).T
    wall = (y > -2.0) & (y < 6.0) & (np.abs(x) < 14.0) & (np.abs(z) < 14.0) & (np.hypot(x - 6.0, z) > 1.6)
    hu = np.where(wall.reshape(scan.hu.shape), SKIN_HU, scan.hu).astype(np.int16)
    narrow = Volume(hu, scan.origin, scan.spacing, scan.direction)
    tissue = refined_solid(solid_of_volumes([narrow], -300.0), [narrow], -300.0, FOCUS)
    tip, ways = np.array([6.0, 40.0, 0.0]), Ways(tissue, room_air(tissue, [narrow]), ENTRY)
    tail = tip + 90.0 * STRAIGHT
    pose = ways.of_pose(tail[None], tip[None])
    assert any(run.pierced for run in pose.runs) == pierced
    depth = tool_depth(tissue, tail[None, None], tip[None, None], np.array([radius]), ENTRY, 8.0).depth[0]
    assert (depth > 0.3) == (radius > 1.6)


def test_between_both_limits_the_verdict_goes_by_the_tissue_that_the_way_leads_round() -> None:
    """A wall beyond 20 mm of the entry, with a hole 7 mm beside the axis: the same wall near the entry would give."""
    hole = np.array(volume().hu)
    k, j, i = np.indices(hole.shape)
    x, y, z = volume().index_to_lps(np.column_stack([i.ravel(), j.ravel(), k.ravel()])).T
    there = (np.abs(x) < 2.5) & (np.hypot(y - 26.0, z) < 2.5)
    hole[there.reshape(hole.shape)] = AIR_HU
    scan = Volume(hole, volume().origin, volume().spacing, volume().direction)
    shaft = (-6.0, 40.0, 0.0), (0.0, 36.0, 0.0)
    far, near = (judged(ways_in(scan, entry), *shaft).runs[0] for entry in (ENTRY, np.array([0.0, 25.0, 0.0])))
    assert far.sideways_mm == near.sideways_mm
    assert far.sideways_mm is not None
    assert 5.0 < far.sideways_mm <= 8.0
    assert (far.pierced, far.gives_mm, near.pierced, near.gives_mm) == (True, 5.0, False, 8.0)


def test_noise_changes_no_verdict() -> None:
    scan = volume()
    random = np.random.default_rng(1)
    hu = scan.hu + random.normal(0.0, 60.0, scan.hu.shape)
    one = random.random(hu.shape)
    hu[one < 0.001], hu[one > 0.999] = AIR_HU, SKIN_HU
    noisy = ways_in(Volume(hu.astype(np.int16), scan.origin, scan.spacing, scan.direction))
    for tip, through, expected in SHAFTS.values():
        assert [one for one in kinds(judged(noisy, tip, through)) if one[2]] == [one for one in expected if one[2]]


def test_what_is_opened_by_hand_is_not_pierced() -> None:
    tip, through, _ = SHAFTS["side"]
    scan = volume()
    tissue = refined_solid(solid_of_volumes([scan], -300.0), [scan], -300.0, FOCUS)
    opened = Ways(opened_field(tissue, [Sphere(np.array([20.0, 18.0, 0.0]), 14.0)]), room_air(tissue, [scan]), ENTRY)
    assert not any(run.pierced for run in judged(opened, tip, through).runs)


def cut(scan: Volume, keep: np.ndarray, value: int) -> Volume:
    return Volume(np.where(keep, scan.hu, value).astype(np.int16), scan.origin, scan.spacing, scan.direction)


def test_where_the_scan_does_not_show_the_room_it_is_not_known() -> None:
    scan = volume()
    ahead = int((0.5 - LOW[1]) / 1.0)
    ends = Volume(np.array(scan.hu[:, ahead:]), scan.index_to_lps([0, ahead, 0]), scan.spacing, scan.direction)
    assert not judged(ways_in(ends), *SHAFTS["nostril"][:2]).known
    pose = judged(ways_in(ends), *SHAFTS["front"][:2])
    assert not pose.known
    assert not any(run.pierced for run in pose.runs)
    # The same with the rest of the scan there, as padding of a value that no air has.
    padded = cut(scan, np.arange(scan.hu.shape[1])[None, :, None] >= ahead, PADDING_HU)
    assert padding(padded)[:, : ahead - 1].all()
    assert not padding(padded)[:, ahead + 1 :].any()
    assert not judged(ways_in(padded), *SHAFTS["front"][:2]).known
    # An image in which nothing is as dark as air, such as an MR.
    bright = Volume(np.abs(scan.hu), scan.origin, scan.spacing, scan.direction)
    grid = head()
    assert grid.has_room
    assert not padding(bright).any()


def test_corners_beyond_the_scanner_s_circle_are_not_air() -> None:
    scan = volume()
    hu = np.array(scan.hu[:, :80, :80])
    j, i = np.indices(hu.shape[1:])
    beyond = np.hypot(i - 39.5, j - 39.5) > 40.5
    hu[:, beyond] = AIR_HU  # as a reader gives padding
    found = padding(Volume(hu, scan.origin, scan.spacing, scan.direction))
    assert (found[:, beyond]).mean() > 0.9
    assert not found[:, ~beyond].any()
    assert not padding(volume()).any()  # the whole head, in air of one value, is no circle


def test_a_bent_tool_is_judged_along_its_bend() -> None:
    """A shaft that would pierce the side is bent into the nostril; one through the nostril into the wall."""
    corner = np.array([6.0, -6.0, 0.0])
    tail, tip = corner + np.array([60.0, -30.0, 0.0]), np.array([6.0, 20.0, 0.0])
    assert head().of_pose(np.array([corner, tail]), np.array([tip, corner])).runs == ()
    assert kinds(head().of_pose(tail[None], tip[None])) == [("room", "body", True)]
    corner, tip = np.array([6.0, 20.0, 0.0]), np.array([-6.0, 24.0, 0.0])
    across = head().of_pose(np.array([corner, corner + 80.0 * STRAIGHT]), np.array([tip, corner]))
    assert kinds(across) == [("body", "body", True)]


def test_poses_between_those_that_are_judged_have_no_other_verdict() -> None:
    """A tool whose tip goes straight in while its shaft swings from the nostril through the rim into the skin."""
    count = 40
    tips = np.column_stack([np.full(count, 6.0), np.linspace(2.0, 40.0, count), np.zeros(count)])
    angle = np.linspace(0.0, 0.9, count)
    tails = tips + 90.0 * np.column_stack([np.zeros(count), -np.cos(angle), np.sin(angle)])
    found = piercing_of(head(), tails[:, None], tips[:, None], range(count))
    every = [head().of_pose(tails[[row]], tips[[row]]) for row in range(count)]
    over = np.array([-np.inf if pose.worst is None else pose.worst.over_mm for pose in every])
    last = np.searchsorted(found.rows, np.arange(count), side="right") - 1
    assert ((over > 0.0) == (found.over_mm[last] > 0.0)).mean() >= 0.95  # but for half a millimetre at the change
    assert found.pierced is not None
    assert len(found.rows) < 0.7 * count
    assert found.worst is not None
    assert found.worst.gives_mm in (5.0, GIVES_AT_ENTRY_MM)


def test_the_column_of_a_recording_has_each_step_s_distance() -> None:
    """A tool that goes in, stands still, and is swung into the skin of the front."""
    tip, through, _ = SHAFTS["rim of the nostril"]
    shafts = [SHAFTS["nostril"][:2], SHAFTS["nostril"][:2], (tip, through), SHAFTS["front"][:2]]
    column, got = SidewaysColumn(head()), []
    for one, place in shafts:
        at = np.array(one)
        ahead = np.array(place) - at
        got.append(column.add((at + 90.0 * ahead / np.linalg.norm(ahead))[None], at[None]))
    (rim,) = judged(head(), tip, through).runs
    (front,) = judged(head(), *SHAFTS["front"][:2]).runs
    assert got == [0.0, 0.0, rim.sideways_mm, front.sideways_mm]
    assert column.found.row == 3
    scan = volume()
    ends = Volume(np.array(scan.hu[:, 37:]), scan.index_to_lps([0, 37, 0]), scan.spacing, scan.direction)
    at = np.array(SHAFTS["nostril"][0])
    assert np.isnan(SidewaysColumn(ways_in(ends)).add((at + 90.0 * STRAIGHT)[None], at[None]))


def test_a_tool_that_touches_nothing_is_judged_once() -> None:
    tips = np.array([6.0, 0.0, 0.0]) + np.linspace(0.0, 40.0, 80)[:, None] * -STRAIGHT
    found = piercing_of(head(), (tips + 90.0 * STRAIGHT)[:, None], tips[:, None], range(80))
    assert found.rows.tolist() == [0]
    assert found.worst is None
    assert found.known


def tilted_coronally(scan: Volume, step: float = 2.0) -> Volume:
    """A scan tilted by 30°, stored in coronal slices with voxels of 2 mm, and padding around it."""
    direction = TILT[:, [0, 2, 1]]
    size = (np.array(scan.hu.shape[::-1]) - 1) * scan.spacing
    half = 0.5 * np.abs(direction.T @ scan.direction) @ size
    counts, middle = (2.0 * half / step).astype(int) + 1, scan.origin + 0.5 * scan.direction @ size
    k, j, i = np.indices(counts[::-1]).reshape(3, -1)
    origin = middle - direction @ half
    index = scan.lps_to_index(origin + step * np.column_stack([i, j, k]) @ direction.T)
    hu = ndimage.map_coordinates(scan.hu, index.T[::-1], np.float32, order=1, cval=PADDING_HU)
    return Volume(hu.reshape(counts[::-1]).astype(np.int16), origin, np.full(3, step), direction)


@pytest.mark.parametrize("stored", ["as it is", "tilted, coronally, at 2 mm"])
def test_in_a_real_head_the_corridor_passes_and_other_shafts_are_told(stored: str, trial_data: Path) -> None:
    """By the grid of 1 mm alone; places that a shaft to the floor of the nose passes are told from the nostril."""
    scan = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")[0]
    scan = scan if stored == "as it is" else tilted_coronally(scan)
    corridor = json.loads((trial_data / "head_ct" / "corridor.json").read_text(encoding="utf-8"))
    places = np.array([point["lps"] for point in corridor["points"]])
    tissue = solid_of_volumes([scan], -300.0)
    air = room_air(tissue, [scan])
    if stored == "as it is":
        assert (air.kinds[:, 0, 0] == UNKNOWN).all()  # the corners beyond the scanner's circle
        assert air.middle_mm == pytest.approx(-22.7, abs=2.0)  # the head lies aside
    ways, tip = Ways(tissue, air, places[0]), places[6]
    for place in places[2:]:
        pose = judged(ways, tuple(place), tuple(places[0]))
        assert pose.known
        assert not any(run.pierced for run in pose.runs)
    told = {
        "dorsum": ((0, 0, 20), True), "root": ((0, 4, 28), True), "ala": ((-10, 0, 4), True),
        "left cheek": ((35, 10, 5), True), "right cheek": ((-35, 10, 5), True), "septum": ((14, 0, 4), False),
    }  # fmt: skip
    if stored != "as it is":
        del told["septum"]  # its cartilage is thinner than these voxels, and is not seen everywhere
    for name, (beside, from_room) in told.items():
        worst = judged(ways, tuple(tip), tuple(places[0] + beside)).worst
        assert worst is not None, name
        assert (worst.pierced, worst.from_room) == (True, from_room), name
