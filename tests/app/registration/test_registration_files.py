"""Files of a registration: tables of measured points, transforms in and out."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from edited_registrations import Edited
from registration_contents import BEADS, NAMES, content_of, measured, pose

from app.cases.model import HEAD_PHANTOM
from app.documents import Document
from app.registration.calibration import registered_to, simulated_robot, why_not_to_base
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.edits import MeasuredPoint, with_measured
from app.registration.file_metadata import FileMetadata
from app.registration.files import TransformFormat, export_text, name_of, read_measured, read_transform
from app.registration.fit_report import report_of
from app.registration.operations import AddPair
from app.services import Services
from vfix_engine.errors import FrameError, InputError
from vfix_engine.registration.transform_files import json_text, tfm_text


@pytest.fixture
def editor(phantom_services: Services) -> Iterator[Edited]:
    made = phantom_services.registrations.create(HEAD_PHANTOM, "Beads")
    yield Edited(phantom_services, made.id)
    if phantom_services.registrations.get(made.id).locked:
        phantom_services.registrations.editor(made.id).set_locked(False)
    phantom_services.registrations.delete(made.id)


def test_measured_points_of_a_table_go_by_label_or_in_order(editor: Edited) -> None:
    for place, name in zip(BEADS, NAMES, strict=True):
        editor.do(AddPair(in_image=place, label=name))
    points = measured(BEADS)
    by_label = [MeasuredPoint(NAMES[i], points[i]) for i in (3, 1, 0)]
    rows = [f"{point.label},{','.join(map(repr, point.position))}" for point in by_label]
    table = "\n".join(["# frame=patient", "# unit=mm", "label,x,y,z", *rows, ""])
    assert read_measured(table.encode(), RegistrationContent()) == tuple(by_label)
    content = editor.change(partial(with_measured, points=by_label)).content
    assert [pair.measured for pair in content.pairs] == [points[0], points[1], None, points[3], None]
    assert {pair.measured_from for pair in content.pairs if pair.measured} == {"file"}
    in_metres = "# unit=m\n# frame=tracker\nx,y,z\n0.001,0.002,-0.003\n"
    assert read_measured(in_metres.encode(), RegistrationContent()) == (MeasuredPoint("", (1.0, 2.0, -3.0)),)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# frame=patient\nlabel,x,y,z\na,1,2,3\n", "does not name its unit"),
        ("# unit=mm\nlabel,x,y,z\na,1,2,3\n", "does not name its frame"),
        ("# unit=mm\n# frame=LPS\nlabel,x,y,z\na,1,2,3\n", "the image's frame"),
        ("# unit=mm\n# frame=base\nlabel,x,y,z\na,1,2,3\n", "registration is to the patient"),
        ("# unit=mm\n# frame=moon\nlabel,x,y,z\na,1,2,3\n", "not known"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\na,1,2\n", "3 cells for 4 columns"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\na,1,2,nan\n", "not a finite"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\na,1,2,3,4\n", "5 cells for 4 columns"),
        ("# unit=mm\n# frame=patient\nx,y,z\n12,5,-60,25,1,5\n", "6 cells for 3 columns, as where decimal commas"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\nchin, left,1.5,2,3\n", "as where a comma in a label"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\na,1,2,3,,\n", "6 cells for 4 columns"),
        ("# unit=mm\n# frame=patient\nname,a,b,c\na,1,2,3\n", "names its columns"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\n", "holds no points"),
        ("# unit=mm\n# frame=patient\nlabel,x,y,z\na,1,2,3", "may be incomplete"),
        ("# unit=mm\n# frame=patient\nx,x,y,z\n1,9,2,3\n", "two columns of the table are called 'x'"),
        ("# unit=mm\n# frame=patient\nx,y,z\n1_0,2,3\n", "must be numbers"),
        ("# unit=mm\n# frame=patient\nx,y,z\n٥٠,2,3\n", "must be numbers"),
        ("# unit=mm\n# frame=patient\nx;y;z\n1,5;2;3\n", "with a decimal point"),
        ('# unit=mm\n# frame=patient\n"x,y,z\n', "damaged"),
        (
            "# unit=mm\n# frame=patient\nlabel,x,y,z\nforehead,1,2,3\nchin,1,2,4\nforehead,1,2,5\n",
            "two rows of the table are called 'forehead'",
        ),
        ("# unit=mm\n# frame=patient\nx,y,z\n" + "1,2,3\n" * 101 + "x\n", "more than 100 points"),
    ],
)
def test_a_table_that_leaves_something_open_is_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_measured(text.encode(), RegistrationContent())


def test_points_without_a_label_are_not_called_the_same() -> None:
    text = "# unit=mm\n# frame=patient\nlabel,x,y,z\n,1,2,3\n,1,2,4\n"
    assert len(read_measured(text.encode(), RegistrationContent())) == 2


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_table_of_a_spreadsheet_is_read(separator: str) -> None:
    text = "# unit=mm\n# frame=patient\nlabel,x,y,z\n{label},1.5,-2,3e1\n".replace(",", separator)
    content = RegistrationContent()
    assert read_measured(text.format(label="chin").encode(), content) == (MeasuredPoint("chin", (1.5, -2.0, 30.0)),)
    assert read_measured(text.format(label="chin, left").encode(), content)[0].label == "chin, left"


def test_errors_say_which_file_it_is() -> None:
    with pytest.raises(InputError, match="the table is not UTF-8"):
        read_measured(b"\xff\xfe", RegistrationContent())
    with pytest.raises(InputError, match="the file of the transform is not UTF-8"):
        read_transform("a.tfm", b"\xff\xfe")


def test_the_frame_of_a_table_is_that_of_the_registration() -> None:
    table = "# unit=mm\n# frame=robot\nlabel,x,y,z\na,1,2,3\n"
    assert read_measured(table.encode(), RegistrationContent(to="base")) == (MeasuredPoint("a", (1.0, 2.0, 3.0)),)
    with pytest.raises(FrameError):
        read_measured(table.encode(), RegistrationContent())


def test_a_transform_goes_out_and_comes_back(editor: Edited) -> None:
    with pytest.raises(InputError, match="no transform yet"):
        export_text(editor.document, "tfm")
    document = editor.become(content_of(0.3))
    for form in ("tfm", "json"):
        again = read_transform(f"head.{form}", export_text(document, form).encode())  # type: ignore[arg-type]
        np.testing.assert_allclose(again.transform, document.content.transform, atol=1e-9)
        assert (again.made_from, again.to, again.pairs) == ("given", "patient", ())
    for name, data in (("a.h5", b"x"), ("a.tfm", b"nothing"), ("a.json", b"{}"), ("a.tfm", b"\xff\xfe")):
        with pytest.raises(InputError):
            read_transform(name, data)
    tfm, told = export_text(document, "tfm"), json.loads(export_text(document, "json"))
    assert tfm.startswith("#Insight Transform File V1.0\n# notice: Not for clinical use")
    for line in (
        "# name: Beads",
        "# registration: from the image (LPS, mm) to the patient (mm)",
        "# parameters: from the patient to the image, as in every ITK file; 3D Slicer moves the image to the patient",
        "# simulated: no",
    ):
        assert line in tfm.splitlines()
    assert told["direction"] == "from the image (LPS, mm) to the patient (mm)"
    assert (told["from"], told["to"], told["name"], told["error_source"]) == ("image", "patient", "Beads", "estimated")
    assert told["fre_mm"] == pytest.approx(document.content.fre_mm, abs=1e-3)
    assert name_of("C:\\scans\\head 1.tfm") == "head 1"
    assert name_of("\x07.tfm") == "Imported registration"


@pytest.mark.parametrize("form", ["tfm", "json"])
def test_a_file_says_what_it_is_to_and_that_it_is_simulated(editor: Edited, form: TransformFormat) -> None:
    """Figures of a file are words; that it is simulated counts, and is said of what is exported again."""
    made = content_of(0.3)
    pairs = tuple(replace(pair, measured_from="simulated") for pair in made.pairs)
    document = editor.become(replace(made, to="base", pairs=pairs))
    text = export_text(document, form)
    again = read_transform(f"head.{form}", text.encode())
    report, before = report_of(again), report_of(document.content)
    assert (again.to, report.simulated, report.fre_mm, report.fle_mm, report.used) == ("base", True, None, None, 0)
    assert report.cautions == ("The file is simulated: nothing here is of a real patient.",)
    assert before.fre_mm is not None
    assert f"Said by the file, and not checked here: 5 points, FRE {before.fre_mm:.2f} mm, error of one" in report.words
    assert again.said is not None
    assert again.said.fle_mm == pytest.approx(before.fle_mm, abs=1e-3)
    with pytest.raises(InputError, match="leads to the robot's base, not to the patient"):
        read_transform(f"head.{form}", text.encode(), "patient")
    with pytest.raises(InputError, match="says what it is to"):
        registered_to(again, "patient")
    document = editor.become(again)
    assert read_transform(f"head.{form}", export_text(document, form).encode()).said_simulated
    assert replace(again, made_from="surface").said_simulated
    fitted = editor.become(replace(again, pairs=made.pairs, made_from="none")).content
    assert (fitted.made_from, fitted.said, report_of(fitted).simulated) == ("pairs", None, False)


def test_a_file_of_before_says_what_it_is_to_as_well() -> None:
    text = tfm_text(pose(), ["direction: from the image (LPS, mm) to the robot's base (mm)", "simulated: yes, all"])
    content = read_transform("a.tfm", text.encode())
    assert (content.to, content.said_simulated) == ("base", True)
    both = text.replace("# simulated", "# registration: from the image (LPS, mm) to the patient (mm)\n# simulated")
    with pytest.raises(InputError, match="to both the patient and the robot's base"):
        read_transform("a.tfm", both.encode())


def test_a_file_that_leaves_open_what_it_is_to_is_the_users_to_say() -> None:
    for name, text in (("a.tfm", tfm_text(pose())), ("a.json", json_text(pose()))):
        open_ = read_transform(name, text.encode())
        assert (open_.to, open_.said) == ("patient", FileMetadata())
        assert read_transform(name, text.encode(), "base").to == "base"
        corrected = registered_to(open_, "base")
        assert (corrected.to, corrected.transform) == ("base", open_.transform)
        assert registered_to(corrected, "patient") == open_
        with pytest.raises(InputError, match="before anything is measured"):
            registered_to(replace(open_, pairs=content_of().pairs), "base")
        with pytest.raises(InputError, match="the robot's calibration goes with"):
            registered_to(replace(corrected, robot=simulated_robot("case", 0.1, 1)), "patient")


def test_a_figure_that_is_none_is_passed_over_and_what_is_no_no_is_simulated() -> None:
    odd = {"simulated": "perhaps", "fre_mm": "inf", "points": 2.5, "error_of_a_point_mm": [0.3], "direction": ["x"]}
    content = read_transform("a.json", json_text(pose(), fixed="patient", origin=odd).encode())
    assert content.said == FileMetadata("patient", simulated=True)
    for no in ("no", "No", False, None):
        said = read_transform("a.json", json_text(pose(), origin={"simulated": no}).encode()).said
        assert said is not None
        assert not said.simulated


def test_a_simulated_transform_goes_through_no_real_robot() -> None:
    robot = replace(simulated_robot("case", 0.1, 1), measured_from="file")
    content = replace(read_transform("a.tfm", tfm_text(pose(), ["simulated: yes"]).encode()), robot=robot)
    assert "the points are simulated" in why_not_to_base(content)


def test_an_itk_file_takes_the_patient_to_the_image() -> None:
    """As ITK and 3D Slicer mean it, which simpleitk reads: the inverse of how the image lies on the patient."""
    sitk = pytest.importorskip("SimpleITK")
    text = export_text(
        Document(
            "r", "registration", "", "n", "c", "", content_of(), (), "", "", 1, False, None, False, False
        ),
        "tfm",
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "head.tfm"
        file.write_text(text, encoding="utf-8")
        read = sitk.ReadTransform(str(file))
    for place, point in zip(BEADS, measured(BEADS), strict=True):
        np.testing.assert_allclose(read.TransformPoint(point), place, atol=1e-6)


@pytest.mark.parametrize("other", ["a\u200b", "a\u00ad", "a\u3164", "\u2060a", "a\ufe0f"])
def test_labels_that_look_the_same_are_the_same(other: str) -> None:
    table = f"# unit=mm\n# frame=patient\nlabel,x,y,z\na,1,2,3\n{other},4,5,6\n"
    with pytest.raises(InputError, match="two rows of the table are called 'a'; give each"):
        read_measured(table.encode(), RegistrationContent())
    content = RegistrationContent(pairs=(FiducialPair("b", (0.0, 0.0, 0.0), None), FiducialPair(other, BEADS[0], None)))
    measured = with_measured(content, [MeasuredPoint("a", (1.0, 2.0, 3.0))], "file")
    assert [pair.measured for pair in measured.pairs] == [None, (1.0, 2.0, 3.0)]
