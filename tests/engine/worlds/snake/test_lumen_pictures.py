"""Pictures: rays go where pixels are, distances are right, and the robot, the pathway and the lumen can be seen."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from vfix_engine.anatomy.lumen.synthetic import SyntheticCourse
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.fit import fit_pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.picture import picture_marks
from vfix_engine.worlds.snake.picture.camera_view import PinholeCamera, RayMesh, endoscope_view
from vfix_engine.worlds.snake.picture.picture import HEIGHT, WIDTH, LumenPictures
from vfix_engine.worlds.snake.picture.picture_marks import RIM, rims
from vfix_engine.worlds.snake.picture.robot_shape import robot_shape

Array = NDArray[np.float64]


def ball(radius: float, middle: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> TriangleMesh:
    made = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return TriangleMesh(made.vertices + np.array(middle), made.faces)


def camera(eye: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = eye
    return pose


def test_a_point_on_a_pixels_ray_is_projected_onto_that_pixel() -> None:
    pose = camera((3.0, -2.0, 5.0))
    pose[:3, :3] = trimesh.transformations.euler_matrix(0.4, -0.7, 1.1)[:3, :3]
    view = PinholeCamera.with_field(pose, 40, 30)
    pixels, distance = view.project(view.eye + 17.0 * view.directions)
    x, y = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    np.testing.assert_allclose(pixels, np.column_stack([x.ravel(), y.ravel()]), atol=1e-9)
    np.testing.assert_allclose(distance, 17.0)
    edge = view.directions.reshape(30, 40, 3)[15, [0, -1]]
    assert np.degrees(np.arccos(edge[0] @ edge[1])) == pytest.approx(70.0, abs=2.0)
    assert np.isnan(view.project((view.eye - view.transform_camera_to_patient[:3, 2])[None])[0]).all()


def test_distances_and_layers_are_those_of_balls() -> None:
    """From outside a ball is met in front and behind; from inside everywhere at its radius."""
    view = PinholeCamera.with_field(camera((0.0, 0.0, -50.0)), 21, 21, 20.0)
    near, far, none = RayMesh(ball(10.0)).layers(view, 3)
    assert near.distance[10, 10] == pytest.approx(40.0, abs=0.1)
    assert far.distance[10, 10] == pytest.approx(60.0, abs=0.1)
    assert near.facing[10, 10] == pytest.approx(1.0, abs=1e-3)
    assert np.isinf(near.distance[0, 0])
    assert near.facing[0, 0] == 0.0
    assert near.triangle[0, 0] == -1
    assert np.isinf(none.distance).all()
    inside = RayMesh(ball(10.0)).first(PinholeCamera.with_field(camera(), 21, 21))
    np.testing.assert_allclose(inside.distance, 10.0, atol=0.1)
    np.testing.assert_allclose(inside.facing, 1.0, atol=1e-3)


def test_the_nearer_of_two_surfaces_is_seen_and_nothing_is_black() -> None:
    view = PinholeCamera.with_field(camera(), 31, 31)
    wall, thing = RayMesh(ball(30.0)), RayMesh(ball(3.0, (0.0, 0.0, 15.0)))
    seen = endoscope_view([(wall, None), (thing, (0.1, 0.1, 1.0))], view)
    assert seen.shape == (31, 31, 3)
    assert seen[15, 15, 2] > seen[15, 15, 0]  # blue in front
    assert seen[0, 0, 0] > seen[0, 0, 2]  # tissue about it
    np.testing.assert_array_equal(seen, endoscope_view([(thing, (0.1, 0.1, 1.0)), (wall, None)], view))
    assert not endoscope_view([(thing, None)], PinholeCamera.with_field(camera((0.0, 0.0, 30.0)), 9, 9)).any()


@pytest.mark.parametrize(("pose", "size", "field"), [(np.eye(3), 9, 70.0), (np.full((4, 4), np.nan), 9, 70.0),
    (np.eye(4), 0, 70.0), (np.eye(4), 9, 180.0)])  # fmt: skip
def test_no_picture_is_taken_with_what_is_no_camera(pose: Array, size: int, field: float) -> None:
    with pytest.raises(InputError):
        PinholeCamera.with_field(pose, size, size, field)


def test_the_shape_of_a_link_ends_where_its_frame_is() -> None:
    snake = SnakeModel(3)
    body, link = robot_shape(snake, snake.frames(np.zeros(6), np.eye(4)), 1, 3)
    assert set(link) == {1, 2}
    np.testing.assert_allclose(body.bounds[:, 2], [28.0, 3 * 28.0 + 6.0], atol=0.1)
    np.testing.assert_allclose(body.bounds[:, 0], [-6.0, 6.0], atol=0.1)


@pytest.mark.parametrize("angles", [1, 12])
def test_rims_lie_on_the_contours(made_up_course: SyntheticCourse, made_up_colon: TriangleMesh, angles: int) -> None:
    pathway = fit_pathway(made_up_colon, made_up_course.curve, contours=20, interpolated=40, angles=angles)
    contours = pathway.contours(extended=True)
    centre, rim = rims(pathway.packed())
    np.testing.assert_allclose(centre, contours.centre, atol=1e-9)
    away = rim - contours.centre[:, None]
    np.testing.assert_allclose(np.einsum("cij,cj->ci", away, contours.tangent), 0.0, atol=1e-9)
    radius = np.linalg.norm(away[:, :-1], axis=2)
    np.testing.assert_allclose(radius, np.broadcast_to(contours.radius, radius.shape), atol=1e-9)


def test_a_picture_shows_robot_pathway_and_lumen(made_up_course: SyntheticCourse, made_up_colon: TriangleMesh) -> None:
    course, snake = made_up_course.curve, SnakeModel(6)
    pathway = fit_pathway(made_up_colon, course, contours=20, interpolated=40)
    base = np.eye(4)
    base[:3, 2] = course.tangent(0.0)
    base[:3, 0] = np.cross([0.0, 1.0, 0.0], base[:3, 2])
    base[:3, 0] /= np.linalg.norm(base[:3, 0])
    base[:3, 1] = np.cross(base[:3, 2], base[:3, 0])
    base[:3, 3] = course.position(-100.0)
    pictures = LumenPictures(made_up_colon, made_up_course.landmarks)
    picture = pictures.draw("anus", snake, np.zeros(12), base, pathway.packed(), words=["six links"])
    head = picture.shape[0] - HEIGHT
    assert picture.dtype == np.uint8
    assert picture.shape == (HEIGHT + head, 3 * WIDTH, 3)
    whole, close, seen = (picture[head:, k * WIDTH : (k + 1) * WIDTH].astype(int) for k in range(3))
    for panel, least in ((whole, 150), (close, 2000)):
        orange = (panel[..., 0] > 90) & (panel[..., 0] > panel[..., 2] + 60) & (panel[..., 1] > panel[..., 2])
        assert np.count_nonzero(orange) > least
        assert np.count_nonzero(np.abs(panel - RIM).max(axis=2) < 30) > 100
        grey = (panel.max(axis=2) - panel.min(axis=2) < 40) & (panel.max(axis=2) < 245)
        assert np.count_nonzero(grey) > 5000
    eye = seen[30:500, 30:500]
    assert eye.std() > 10.0
    assert (eye[..., 0] >= eye[..., 2]).mean() > 0.99  # tissue
    assert (picture[:head] < 100).any()
    assert (seen[580:640] < 100).any()  # the words
    assert (seen[HEIGHT - 28 : HEIGHT - 8, :220] < 100).any()  # HAZ-35: 'not for clinical use'


def test_names_of_landmarks_lie_on_no_dot_and_on_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three places a few pixels apart, as the valve and the appendix are on a real colon, and one that is ringed."""
    written: list[tuple[str, picture_marks.PixelBox]] = []

    def keep(
        picture: Array, words: str, at: tuple[int, int], scale: float, *_: object, bold: bool, **more: bool
    ) -> None:
        wide = picture_marks.text_width(words, scale, bold)
        written.append((words, (at[0], at[1] - 15, at[0] + wide, at[1])))

    monkeypatch.setattr(picture_marks, "write", keep)
    view = PinholeCamera(np.eye(4), 400, 300, 100.0)  # so that a millimetre is a pixel, 100 mm ahead
    places = {"valve": (5, 0, 100), "orifice": (-12, 8, 100), "tip": (-16, 22, 100), "end": (60, 60, 100)}
    picture = np.full((300, 400, 3), 255, dtype=np.uint8)
    picture_marks.draw_marks(picture, view, places, {name: f"the {name}" for name in places}, "end")
    assert [words for words, _ in written] == ["the end", "the valve", "the orifice", "the tip"]
    middle = {f"the {name}": view.project(np.array([at], dtype=np.float64))[0][0] for name, at in places.items()}
    for k, (words, box) in enumerate(written):
        for other, at in middle.items():
            assert not (box[0] - 4 < at[0] < box[2] + 4 and box[1] - 4 < at[1] < box[3] + 4), (words, other)
        for _, two in written[:k]:
            assert box[2] < two[0] or two[2] < box[0] or box[3] < two[1] or two[3] < box[1]
    for name in ("valve", "orifice", "tip"):
        u, v = np.rint(middle[f"the {name}"]).astype(int)
        assert tuple(picture[v, u]) == picture_marks.MARK
