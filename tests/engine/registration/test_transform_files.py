"""Transforms in files: against SimpleITK's own reader and its stored answers; what is no rigid transform is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import SimpleITK
from registration_cases import placed, some_pose
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.registration.transform_files import (
    json_text,
    read_transform,
    tfm_comments,
    tfm_text,
    transform_from_json,
    transform_from_tfm,
    write_transform,
)

POINTS = np.array([(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10), (-24.6, -99.4, -7.5), (100.5, -37.25, 12.125)])


def file_text(kind: str, parameters: str, fixed: str = "0 0 0") -> str:
    return (
        f"#Insight Transform File V1.0\n#Transform 0\nTransform: {kind}\nParameters: {parameters}\n"
        f"FixedParameters: {fixed}\n"
    )


def composite(*members: tuple[str, str]) -> str:
    """A file of a composite with these kinds and parameters."""
    blocks = [file_text(*member).partition("\n")[2] for member in members]
    return "".join(["#Insight Transform File V1.0\n#Transform 0\nTransform: CompositeTransform_double_3_3\n", *blocks])


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_a_file_that_was_cut_anywhere_is_refused(line_end: str) -> None:
    versor = file_text("VersorRigid3DTransform_double_3_3", "0.1 -0.2 0.3 7 8 9", "10.5 80.25 -47.75")
    euler = file_text("Euler3DTransform_double_3_3", "0.1 -0.2 0.3 7 8 9", "10.5 80.25 -47.75 0")
    for whole in (versor, euler, tfm_text(some_pose(2), ["simulated: yes"])):
        whole = whole.replace("\n", line_end)
        transform_from_tfm(whole)
        for length in range(len(whole) - len(line_end) + 1):
            with pytest.raises(InputError):
                transform_from_tfm(whole[:length])


def test_a_composite_that_was_cut_in_a_line_or_below_the_head_of_a_member_is_refused() -> None:
    """A cut after a whole member is no cut that the file could tell: it does not say how many there are."""
    versor = ("VersorRigid3DTransform_double_3_3", "0.1 -0.2 0.3 7 8 9")
    whole, one = composite(versor, versor), composite(versor)
    for length in range(len(whole)):
        if length != len(one):
            with pytest.raises(InputError):
                transform_from_tfm(whole[:length])


def test_a_transform_about_a_centre_says_the_centre() -> None:
    versor = file_text("VersorRigid3DTransform_double_3_3", "0.1 -0.2 0.3 7 8 9", "")
    for text in (versor, versor.replace("FixedParameters: \n", "")):
        with pytest.raises(InputError, match="its centre as three fixed parameters, not 0"):
            transform_from_tfm(text)
    shift = file_text("TranslationTransform_double_3_3", "1 2 3", "")
    for text in (shift, shift.replace("FixedParameters: \n", "")):
        assert transform_from_tfm(text)[:3, 3] == pytest.approx([-1, -2, -3])


def test_comments_that_say_something_are_told() -> None:
    text = tfm_text(np.eye(4), ["simulated: yes, all", "by hand", "name: a: b"])
    assert tfm_comments(text) == [("simulated", "yes, all"), ("name", "a: b")]
    assert tfm_comments("\ufeff" + text.replace("\n", "\r\n")) == tfm_comments(text)
    with pytest.raises(InputError, match="no ITK transform"):
        tfm_comments("# name: a\n")


def test_comments_count_wherever_they_stand() -> None:
    """An editor's blank line, or another program's order, takes away no 'simulated'."""
    magic, *rest = tfm_text(np.eye(4), ["simulated: yes"]).splitlines(keepends=True)
    comment = next(line for line in rest if "simulated" in line)
    others = [line for line in rest if line != comment]
    for text in ("".join([magic, "\n", *rest]), "".join([magic, *others[:2], comment, *others[2:]])):
        assert tfm_comments(text) == [("simulated", "yes")]


@pytest.mark.parametrize("name", ["a.tfm", "a.txt", "a.json", "A.TFM"])
def test_what_is_written_is_read(tmp_path: Path, name: str) -> None:
    for seed in range(20):
        pose = some_pose(seed, 1000.0)
        write_transform(tmp_path / name, pose)
        assert placed(read_transform(tmp_path / name), POINTS) == pytest.approx(placed(pose, POINTS), abs=1e-9)


def test_the_file_maps_the_fixed_frame_to_the_moving(tmp_path: Path) -> None:
    """SimpleITK's reading of the file takes points of the fixed frame back to the moving."""
    pose = some_pose(3)
    write_transform(tmp_path / "t.tfm", pose)
    itk = SimpleITK.ReadTransform(str(tmp_path / "t.tfm"))
    for point, fixed in zip(POINTS, placed(pose, POINTS), strict=True):
        assert itk.TransformPoint(fixed.tolist()) == pytest.approx(point, abs=1e-9)


def itk_transforms() -> list[SimpleITK.Transform]:
    euler = SimpleITK.Euler3DTransform((5.0, -20.0, 30.0), 0.2, -0.35, 0.5, (12.5, -3.0, 40.0))
    zyx = SimpleITK.Euler3DTransform((5.0, -20.0, 30.0), 0.2, -0.35, 0.5, (12.5, -3.0, 40.0))
    zyx.SetComputeZYX(True)
    versor = SimpleITK.VersorRigid3DTransform()
    versor.SetRotation((1.0, 2.0, -0.5), 2.5)
    versor.SetTranslation((7.0, 8.0, 9.0))
    versor.SetCenter((1.0, 2.0, 3.0))
    affine = SimpleITK.AffineTransform(3)
    affine.SetMatrix(Rotation.from_rotvec([0.3, -0.2, 2.0]).as_matrix().ravel().tolist())
    affine.SetTranslation((-5.0, 6.5, 2.0))
    affine.SetCenter((-10.0, 15.0, 7.0))
    shift = SimpleITK.TranslationTransform(3, (1.5, -2.5, 3.5))
    half, double = SimpleITK.AffineTransform(3), SimpleITK.AffineTransform(3)
    half.Scale(0.5)
    double.Scale(2.0)
    chains = ([versor], [euler, affine], [affine, euler], [versor, zyx, shift, affine, euler], [half, versor, double])
    return [euler, zyx, versor, affine, shift, *map(SimpleITK.CompositeTransform, chains)]


@pytest.mark.parametrize("transform", itk_transforms(), ids=lambda one: one.GetName())
def test_it_is_simple_itks_reading(tmp_path: Path, transform: SimpleITK.Transform) -> None:
    SimpleITK.WriteTransform(transform, str(tmp_path / "t.tfm"))
    ours = read_transform(tmp_path / "t.tfm")
    there = np.array([transform.TransformPoint(point.tolist()) for point in POINTS])
    assert placed(ours, there) == pytest.approx(POINTS, abs=1e-6)
    assert (np.linalg.norm(there - POINTS, axis=1) > 1.0).any()


@pytest.mark.parametrize(
    "name",
    [
        "affine-LPS.itk.tfm", "affine-oblique.itk.tfm", "from-fsnative_to-bold_mode-image.tfm",
        "from-scanner_to-bold_mode-image.tfm", "sitk_euler3d_centre.tfm", "sitk_versorrigid3d.tfm",
        "sitk_translation.tfm",
    ],
)  # fmt: skip
def test_references_are_read(trial_data: Path, name: str) -> None:
    """Stored answers of SimpleITK; 1e-3 mm for files of six digits, whose matrix is a rotation to 1e-5 only."""
    folder = trial_data / "formats" / "transforms"
    known = json.loads((folder / "reference_SimpleITK.json").read_text(encoding="utf-8"))[name]
    there = np.array(known["points_out_LPS"])
    off = 1e-6 if name.startswith("sitk") else 1e-3
    assert placed(read_transform(folder / name), there) == pytest.approx(np.array(known["points_in_LPS"]), abs=off)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("transforms/sitk_affine_centre.tfm", "scales or shears"),
        ("transforms/hmc-itk.tfm", "transforms; give one"),
        ("transforms/itktflist.tfm", "transforms; give one"),
        ("transforms/sitk_composite.tfm", "'ScaleTransform', which is not rigid"),
        ("transforms/sitk_composite.h5", "save the transform as text"),
        ("malformed/reflection.tfm", "mirror"),
        ("malformed/ras.mrk.json", "schema"),
        ("malformed/truncated.mrk.json", "not valid JSON"),
    ],
)
def test_reference_files_that_are_not_rigid_are_refused(trial_data: Path, name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_transform(trial_data / "formats" / name)


ROTATION = "0 -1 0 1 0 0 0 0 1"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no ITK transform"),
        ("MATLAB 5.0 MAT-file", "no ITK transform"),
        ("#Insight Transform File V1.0\n", "0 transforms"),
        (file_text("AffineTransform_double_3_3", "-1 0 0 0 1 0 0 0 1 0 0 0"), "mirror"),
        (file_text("AffineTransform_double_3_3", "1.01 0 0 0 1.01 0 0 0 1.01 0 0 0"), "scales or shears"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2"), "12 parameters, not 11"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 nan"), "not finite"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 x"), "not numbers"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 1e9"), "moves by more than 1,000,000 mm"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 1_0"), "not numbers"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 3", "1 2"), "centre"),
        (file_text("AffineTransform_double_2_2", "1 0 0 1 0 0"), "three dimensions"),
        (file_text("BSplineTransform_double_3_3", "1"), "BSplineTransform, which deforms"),
        (file_text("Similarity3DTransform_double_3_3", "1"), "not rigid or not known"),
        (
            composite(
                ("AffineTransform_double_3_3", f"{ROTATION} 1 2 3"), ("DisplacementFieldTransform_double_3_3", "1")
            ),
            "DisplacementFieldTransform, which deforms",
        ),
        (
            composite(
                ("AffineTransform_double_3_3", f"{ROTATION} 1 2 3"),
                ("AffineTransform_double_3_3", "1.1 0 0 0 1 0 0 0 1 0 0 0"),
            ),
            "scales or shears, by 1 to 1.1",
        ),
        (composite(*[("AffineTransform_double_3_3", "1e200 0 0 0 1e200 0 0 0 1e200 0 0 0")] * 2), "not finite"),
        (composite(), "0 transforms"),
        (composite(("CompositeTransform_double_3_3", "")), "not rigid or not known"),
        (file_text("VersorRigid3DTransform_double_3_3", "0.9 0.9 0 1 2 3"), "no rotation"),
        (file_text("QuaternionRigidTransform_double_3_3", "0 0 1 1 0 0 0"), "no rotation"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 3") + "Parameters: 1\n", "once"),
        (file_text("AffineTransform_double_3_3", f"{ROTATION} 1 2 3") + "Hello\n", "does not belong"),
        ("#Insight Transform File V1.0\nParameters: 1\n", "once"),
    ],
)
def test_wrong_text_is_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        transform_from_tfm(text)


def test_a_quaternion_and_windows_line_ends_are_read() -> None:
    half = np.sqrt(0.5)
    text = file_text("QuaternionRigidTransform_double_3_3", f"0 0 {half} {half} 1 2 3").replace("\n", "\r\n")
    expected = np.linalg.inv([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    assert transform_from_tfm(text) == pytest.approx(expected, abs=1e-12)
    matrix = file_text("MatrixOffsetTransformBase_double_3_3", f"{ROTATION} 1 2 3")
    assert transform_from_tfm(matrix) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("wrong", ["[]", "{}", "{", '{"schema": "vfix-transform/1", "unit": "m"}', "[" * 100_000])
def test_wrong_json_is_refused(wrong: str) -> None:
    with pytest.raises(InputError):
        transform_from_json(wrong)
    known = json.loads(json_text(np.eye(4)))
    with pytest.raises(InputError, match="the key 'unit' stands twice"):
        transform_from_json(json_text(np.eye(4)).replace('"unit"', '"unit": "m", "unit"'))
    with pytest.raises(InputError, match="a number of it is too large"):
        transform_from_json(json_text(np.eye(4)).replace("1.0", "9" * 5000, 1))
    for name, value in (("to", "moving"), ("axes", "RAS"), ("transform", np.diag([1, 1, -1, 1]).tolist())):
        with pytest.raises(InputError):
            transform_from_json(json.dumps({**known, name: value}))


def test_what_a_file_says_of_its_origin_is_passed_over() -> None:
    pose = some_pose(4)
    text = tfm_text(pose, ["name: Köpfe #2", "from the image to the patient"])
    assert text.splitlines()[:3] == [
        "#Insight Transform File V1.0",
        "# name: Köpfe #2",
        "# from the image to the patient",
    ]
    assert transform_from_tfm(text) == pytest.approx(pose, abs=1e-12)
    named = json_text(pose, moving="image", fixed="patient", origin={"name": "Beads", "transform": "not this"})
    assert (json.loads(named)["from"], json.loads(named)["to"], json.loads(named)["name"]) == (
        "image",
        "patient",
        "Beads",
    )
    assert transform_from_json(named) == pytest.approx(pose, abs=1e-12)
    assert transform_from_json(json_text(pose)) == pytest.approx(pose, abs=1e-12)
    with pytest.raises(InputError, match="one line"):
        tfm_text(pose, ["two\nTransform: AffineTransform_double_3_3"])
    with pytest.raises(InputError, match="'patient'"):
        json_text(pose, fixed="tracker")


def test_wrong_names_and_transforms_are_refused(tmp_path: Path) -> None:
    for wrong in (lambda: write_transform(tmp_path / "a.h5", np.eye(4)), lambda: read_transform(tmp_path / "a.xml")):
        with pytest.raises(InputError):
            wrong()
    for write in (tfm_text, json_text):
        with pytest.raises(InputError, match="rigid"):
            write(np.diag([1.0, 1.0, -1.0, 1.0]))
    (tmp_path / "big.tfm").write_text("#" * 1_000_001)
    with pytest.raises(InputError, match="too large"):
        read_transform(tmp_path / "big.tfm")
