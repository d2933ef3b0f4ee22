"""Segmentation by a band of Hounsfield units, and air within the body."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vfix_engine.errors import ImageError
from vfix_engine.geometry.proximity import ProximityTree
from vfix_engine.geometry.side import SurfaceSide
from vfix_engine.imaging.airway import body, inner_air
from vfix_engine.imaging.phantom import load_head_ct, load_landmarks
from vfix_engine.imaging.readers import read_volume
from vfix_engine.imaging.segmentation import PRESETS, Band, SegmentRequest, segment
from vfix_engine.imaging.volume import Volume


def balls() -> Volume:
    """Balls of 600 HU with radii of 6 and 3 mm and one of 40 HU with 4 mm, in air."""
    k, j, i = np.indices((50, 50, 60)).astype(float) * 0.5
    hu = np.full(k.shape, -1000.0)
    for centre, radius, value in (((9, 9, 12), 6.0, 600), ((8, 9, 25), 3.0, 600), ((19, 19, 8), 4.0, 40)):
        distance = np.sqrt(sum((a - c) ** 2 for a, c in zip((i, j, k), centre[::1], strict=True)))
        hu = np.where(distance < radius, value, hu)
    return Volume(hu.astype(np.int16), [10.0, 0.0, -5.0], [0.5, 0.5, 0.5], np.eye(3))


def sphere_mm3(radius: float) -> float:
    return 4.0 / 3.0 * np.pi * radius**3


def test_a_band_takes_what_lies_in_it() -> None:
    bone = segment(balls(), SegmentRequest(PRESETS["bone"]))
    soft = segment(balls(), SegmentRequest(Band(0.0, 200.0)))
    assert bone.volume_mm3 == np.count_nonzero(balls().hu == 600) / 8.0
    assert soft.volume_mm3 == pytest.approx(sphere_mm3(4.0), rel=0.05)
    assert (bone.islands, bone.left_out, soft.islands) == (2, 0, 1)
    centre = np.array([29.0, 19.0, 3.0])
    assert np.abs(np.linalg.norm(soft.mesh.vertices - centre, axis=1) - 4.0).max() < 0.75
    outwards = soft.mesh.triangles.mean(axis=1) - centre
    assert (np.einsum("ij,ij->i", soft.mesh.face_normals, outwards) > 0).mean() > 0.99


def test_islands_are_left_out_and_told() -> None:
    largest = segment(balls(), SegmentRequest(PRESETS["bone"], largest=True))
    assert (largest.islands, largest.left_out) == (2, 1)
    assert largest.volume_mm3 == pytest.approx(sphere_mm3(6.0), rel=0.03)
    large = segment(balls(), SegmentRequest(PRESETS["bone"], least_mm3=300.0))
    assert large.mesh.content_hash == largest.mesh.content_hash
    with pytest.raises(ImageError, match="every island is smaller"):
        segment(balls(), SegmentRequest(PRESETS["bone"], least_mm3=5000.0))


def test_a_crop_box_closes_the_surface_where_it_ends() -> None:
    box = ((10.0, 0.0, -5.0), (19.0, 30.0, 30.0))  # through the middle of the large ball
    half = segment(balls(), SegmentRequest(PRESETS["bone"], crop_mm=box))
    a, b, c = np.moveaxis(half.mesh.triangles - half.mesh.bounds.mean(axis=0), 1, 0)
    enclosed = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert half.mesh.bounds[1][0] < 19.6
    assert enclosed == pytest.approx(half.volume_mm3, rel=0.12)
    with pytest.raises(ImageError, match="crop box"):
        segment(balls(), SegmentRequest(PRESETS["bone"], crop_mm=((500.0, 0.0, 0.0), (510.0, 5.0, 5.0))))


def test_smoothing_tells_how_far_it_moved_the_border() -> None:
    sharp = segment(balls(), SegmentRequest(PRESETS["bone"]))
    smooth = segment(balls(), SegmentRequest(PRESETS["bone"], smooth_mm=1.0))
    random = np.random.default_rng(4).dirichlet(np.ones(3), 20)
    places = np.einsum("pc,fci->fpi", random, sharp.mesh.triangles).reshape(-1, 3)
    moved = ProximityTree(smooth.mesh).point_distance(places)[0].max()
    assert 0.1 < moved <= smooth.smoothed_mm < moved + 0.2
    assert sharp.smoothed_mm == 0.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"band": Band(300.0, 200.0)}, "must rise"),
        ({"band": Band(np.nan, 200.0)}, "must rise"),
        ({"smooth_mm": 9.0}, "smoothing takes"),
        ({"least_mm3": -1.0}, "island"),
        ({"crop_mm": ((np.nan, 0, 0), (1, 1, 1))}, "finite"),
    ],
)
def test_what_makes_no_sense_is_refused(change: dict, words: str) -> None:
    with pytest.raises(ImageError, match=words):
        SegmentRequest(**{"band": PRESETS["bone"]} | change)


def at(mask: np.ndarray, volume: Volume, points: np.ndarray) -> np.ndarray:
    i, j, k = np.rint(volume.lps_to_index(points)).astype(int).T
    return mask[k, j, i]


def test_air_within_the_phantom_is_told_from_the_rooms() -> None:
    ct = load_head_ct()
    corridor = np.array([point.position for point in load_landmarks().corridor])
    inner = inner_air(ct)
    assert at(inner, ct, corridor[2:]).all()
    far = corridor[0] - np.array([0.0, 20.0, 0.0])  # before the face
    assert not at(body(ct), ct, far[None])[0]
    seen = float((inner & before_the_face(ct)).sum() * ct.spacing.prod())
    assert seen < 150.0  # mm³, in the nostrils' rims
    found = segment(ct, SegmentRequest(PRESETS["air"], largest=True))
    side = SurfaceSide(ProximityTree(found.mesh))
    assert not side.outside(corridor[2:]).any()
    assert side.outside(far[None]).all()


def test_air_within_a_real_head(trial_data: Path) -> None:
    volume, _ = read_volume(trial_data / "head_ct" / "cthead_hu_lps.nrrd")
    data = json.loads((trial_data / "head_ct" / "corridor.json").read_text(encoding="utf-8"))
    points = np.array([point["lps"] for point in data["points"]])
    inner = inner_air(volume)
    assert at(inner, volume, points[1:]).mean() > 0.9
    assert not at(body(volume), volume, points[:1] - [[0.0, 25.0, 0.0]])[0]


def test_air_keeps_its_largest_pieces_unless_all_are_asked_for() -> None:
    hu = np.full((20, 20, 20), 40, dtype=np.int16)
    for low, size in ((1, 3), (6, 4), (12, 6)):  # 27, 64 and 216 mm³
        hu[low : low + size, low : low + size, low : low + size] = -1000
    air = replace(PRESETS["air"], inside_body=False)
    volume = Volume(hu, np.zeros(3), np.ones(3), np.eye(3))
    few, every = segment(volume, SegmentRequest(air)), segment(volume, SegmentRequest(air, least_mm3=0.0))
    assert (few.islands, few.left_out, few.volume_mm3) == (3, 2, 216.0)
    assert (every.islands, every.left_out) == (3, 0)
    assert PRESETS["bone"].least_mm3 == 0.0


def head_with_a_nostril() -> Volume:
    """A body behind y = 20 mm with a nose of 12 mm before it, a nostril and the airway behind; the scan goes on above.

    Beside the nose lie a groove in the cheek and the corners at its sides: air of the room in front of the skin.
    """
    k, j, i = np.indices((60, 60, 70)).astype(float)
    beside = np.abs(i - 35.0)
    body_there = (j > 20.0) & (beside < 28.0) & (k < 50.0)
    nose = (j > 8.0) & (j < 22.0) & (beside < 7.0) & (k > 18.0) & (k < 40.0)
    groove = (np.abs(beside - 18.0) < 4.0) & (j < 25.0)
    nostril = (np.hypot(i - 35.0, j - 14.0) < 3.5) & (k < 32.0)
    airway = (np.hypot(i - 35.0, k - 30.0) < 5.5) & (j > 14.0) & (j < 55.0)
    solid = (body_there & ~groove | nose) & ~nostril & ~airway
    return Volume(np.where(solid, 40, -1000).astype(np.int16), np.zeros(3), np.ones(3), np.eye(3))


def before_the_face(volume: Volume) -> np.ndarray:
    """Voxels with no tissue between them and the front of the scan."""
    ahead: np.ndarray = (volume.hu >= -300).cumsum(axis=1) == 0
    return ahead


def test_air_within_the_body_ends_at_the_skin() -> None:
    head = head_with_a_nostril()
    inner = inner_air(head)
    airway = np.array([[35.0, y, 30.0] for y in range(20, 54)])
    assert at(inner, head, airway).all()
    assert not (inner & before_the_face(head)).any()
    assert not inner[50:].any()  # above the head, where the scan goes on
    assert not at(inner, head, np.array([[35.0, 14.0, 17.0], [17.0, 23.0, 30.0]])).any()  # before the nostril, a groove
