"""Exchange: round trips keep positions to 1e-6 mm, names and frame; ambiguous and broken files are refused."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from app.exchange.plan_files import (
    FORMATS,
    CurveSample,
    PointsAs,
    export_text,
    format_of,
    from_native_json,
    read_plan,
    read_targets,
    to_markups,
    write_export,
)
from app.kit.errors import PointsUnclear, TooLarge
from app.kit.names import check_label
from app.plans.document import PLAN as PLANS
from app.plans.model import MAX_POINTS, PlanContent, PlanPath, PlanPoint, content_from_json
from app.registration.document import RegistrationContent
from app.registration.files import read_measured
from vfix_engine.errors import FrameError, InputError, PlanError
from vfix_engine.json_text import MAX_DEPTH, parse_json

POINTS = (
    PlanPoint("a", "entry, left", (-29.512345678901, 1 / 3, -14.0)),
    PlanPoint("b", '=HYPERLINK("x")', (1e-7, -0.0, 9999.0)),
    PlanPoint("c", "'quoted' <b>", (0.1 + 0.2, -1e3, 5.0)),
)
PLAN = replace(
    PLANS.draft(
        "case-1",
        "ab" * 32,
        'Left "nose", ♥ # <i>',
        PlanContent(
            targets=(PlanPoint("t", "-ostium", (1.0, 2.0, 3.0)),),
            robot={"name": "steady_hand", "base": [float(n) for n in range(16)], "q_start": [0.25] * 7},
            settings={"margin_mm": 0.4},
            paths=(PlanPath(points=POINTS),),
        ),
        "plan-1",
    ),
    created="2026-01-01T00:00:00.000+00:00",
    modified="2026-01-01T00:00:00.000+00:00",
)
CURVE = (
    CurveSample(0.0, (0.0, 0.0, 0.0), 2.5),
    CurveSample(0.5, (0.5, 0.0, 0.0), 0.4),
    CurveSample(1.0, (1.0, 0.0, 0.0), None),
)


def assert_same(read: tuple[PlanPoint, ...], written: tuple[PlanPoint, ...]) -> None:
    assert [point.label for point in read] == [point.label for point in written]
    for mine, theirs in zip(read, written, strict=True):
        assert math.dist(mine.position, theirs.position) <= 1e-6


@pytest.mark.parametrize("form", FORMATS)
def test_a_plan_comes_back(form: str, tmp_path: Path) -> None:
    """HAZ-14, HAZ-35."""
    path = tmp_path / f"plan.{form}"
    write_export(path, export_text(PLAN, format_of(path.name), CURVE))
    assert "Not for clinical use" in path.read_text(encoding="utf-8")
    file = read_plan(path.name, path.read_bytes())
    assert file.name == PLAN.name
    assert_same(file.content.points, PLAN.content.points)
    assert_same(file.content.targets, PLAN.content.targets)


def test_the_own_format_brings_everything_back() -> None:
    file = from_native_json(export_text(PLAN, "json"))
    assert file.content == PLAN.content
    assert file.case_hash == PLAN.case_hash


def test_a_retired_setting_of_an_older_file_is_passed_over() -> None:
    """HAZ-14: files exported when the controller still had it are read as they were, without it."""
    data = json.loads(export_text(PLAN, "json"))
    data["settings"]["group_flat_mm"] = 4.0
    file = from_native_json(json.dumps(data))
    assert file.content == PLAN.content
    data["settings"]["group_flat"] = 4.0
    with pytest.raises(InputError, match="group_flat;"):
        from_native_json(json.dumps(data))


@pytest.mark.parametrize("form", FORMATS)
def test_a_plan_without_points_comes_back(form: str) -> None:
    empty = replace(PLAN, content=replace(PLAN.content, targets=PLAN.content.targets).with_points(()))
    file = read_plan(f"x.{form}", export_text(empty, format_of(f"x.{form}")).encode())
    assert file.content.points == ()
    assert_same(file.content.targets, PLAN.content.targets)


def is_label(text: str) -> bool:
    try:
        return check_label(text, "label") == text
    except InputError:
        return False


LABELS = st.text(max_size=12).filter(is_label)


NAMES = st.builds(
    str.__add__,
    st.sampled_from(["left", "x resampled", "Nase ♥"]),
    st.sampled_from(["", " resampled", " not reached", " targets", " resampled not reached"]),
)


@hypothesis_settings(max_examples=100, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(st.text(max_size=12).filter(is_label), st.tuples(*[st.floats(-9999, 9999)] * 3)),
        min_size=1,
        max_size=4,
    ),
    NAMES,
    st.sampled_from(FORMATS),
    st.sampled_from([(), CURVE, CURVE[:2], CURVE[2:]]),
)
def test_any_points_come_back(
    rows: list[tuple[str, tuple[float, float, float]]], name: str, form: str, driven: tuple[CurveSample, ...]
) -> None:
    """HAZ-14: whatever the plan is called, and however far it was driven."""
    points = tuple(PlanPoint(f"p{n}", label, place) for n, (label, place) in enumerate(rows))
    plan = replace(
        PLAN,
        name=name,
        content=replace(PLAN.content, targets=points[:1] and (replace(points[0], id="t"),)).with_points(points),
    )
    file = read_plan(f"x.{form}", export_text(plan, format_of(f"x.{form}"), driven).encode())
    assert file.name == name
    assert_same(file.content.points, points)
    assert_same(file.content.targets, plan.content.targets)


def test_markups_are_of_the_schema_and_carry_the_clearance() -> None:
    data = json.loads(to_markups(PLAN, CURVE, "Held by bone."))
    assert data["@schema"].endswith("markups-schema-v1.0.3.json#")
    path, dense, beyond, targets = data["markups"]
    assert [m["type"] for m in data["markups"]] == ["Curve", "Curve", "Curve", "Fiducial"]
    for markup in data["markups"]:
        assert (markup["coordinateSystem"], markup["coordinateUnits"]) == ("LPS", "mm")
        assert markup["description"] == "Not for clinical use. Held by bone."
        assert all(point["description"].startswith("Not for clinical use") for point in markup["controlPoints"])
    clearance = dense["measurements"][0]
    assert (clearance["name"], clearance["units"], clearance["value"]) == ("clearance", "mm", 0.4)
    assert clearance["controlPointValues"] == [2.5, 0.4]
    assert len(dense["controlPoints"]) == 2
    assert [point["position"][0] for point in beyond["controlPoints"]] == [0.5, 1.0]
    assert (len(path["controlPoints"]), len(targets["controlPoints"])) == (3, 1)


def markups(*items: dict[str, object]) -> bytes:
    return json.dumps({"markups": items}).encode()


def curve(**values: object) -> dict[str, object]:
    return {
        "type": "Curve",
        "coordinateSystem": "LPS",
        "controlPoints": [{"label": "a", "position": [1, 2, 3]}],
        **values,
    }


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, (1, 2, 3)),
        ({"coordinateSystem": "RAS"}, (-1, -2, 3)),
        ({"coordinateSystem": "0"}, (-1, -2, 3)),
        ({"coordinateUnits": "um"}, (0.001, 0.002, 0.003)),
        ({"coordinateUnits": ["mm", "UCUM", "millimeter"]}, (1, 2, 3)),
    ],
)
def test_frames_and_units_are_turned_into_lps_mm(changes: dict[str, object], expected: tuple[float, ...]) -> None:
    """HAZ-14."""
    assert read_plan("x.json", markups(curve(**changes))).content.points[0].position == pytest.approx(
        expected, abs=1e-12
    )


def test_targets_are_never_taken_for_the_path() -> None:
    """An export whose path was deleted elsewhere is refused, though one list of points is left."""
    data = json.loads(to_markups(PLAN, CURVE))
    for kept in ([1, 2, 3], [1, 3], [2, 3]):
        with pytest.raises(PlanError, match="0 curves and 1 lists"):
            read_plan("x.json", markups(*[data["markups"][n] for n in kept]))
    assert_same(read_targets("x.json", markups(data["markups"][3])), PLAN.content.targets)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("x.json", markups(curve(type="Fiducial", name="F"))),
        (
            "x.fcsv",
            b"# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = x,y,z,label\n1,2,3,a\n",
        ),
    ],
)
def test_whether_a_list_of_points_is_a_path_is_asked(name: str, data: bytes) -> None:
    """Targets taken for a path would have the tool driven from one to the next."""
    with pytest.raises(PointsUnclear, match="1 points and no curve"):
        read_plan(name, data)
    path, targets = (read_plan(name, data, points_as=word).content for word in get_args(PointsAs))
    assert [(p.label, p.position) for p in path.points] == [(p.label, p.position) for p in targets.targets]
    assert (len(path.points), path.targets, targets.points) == (1, (), ())


def test_a_curve_of_another_program_may_have_any_name_and_measurement() -> None:
    for name in ("left resampled", "left not reached"):
        foreign = curve(name=name, measurements=[{"name": "clearance", "value": 1.0}])
        file = read_plan("x.json", markups(foreign, curve(type="Fiducial", name="seen")))
        assert (file.name, len(file.content.points), len(file.content.targets)) == (name, 1, 1)


def test_a_frame_that_nobody_names_is_asked_for() -> None:
    """HAZ-14."""
    data = markups({"type": "Curve", "controlPoints": [{"position": [1, 2, 3]}]})
    with pytest.raises(FrameError) as refusal:
        read_plan("x.json", data)
    assert refusal.value.missing == ("frame",)
    assert read_plan("x.json", data, "RAS").content.points[0].position == (-1, -2, 3)
    with pytest.raises(FrameError, match="not RAS"):
        read_plan("x.json", markups(curve()), "RAS")
    table = b"label,x,y,z\na,1,2,3\n"
    with pytest.raises(FrameError):
        read_plan("x.csv", table)
    assert read_plan("x.csv", table, "RAS").content.points[0].position == (-1, -2, 3)


LPS = b"# frame=LPS\n# unit=mm\nlabel,x,y,z\n"
SLICER = b"# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,label\n"
WIDE = SLICER.replace(b"label", b"ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID")


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("x.json", b""),
        ("x.json", b"[1]"),
        ("x.json", b"\xff\xfe"),
        ("x.json", b"[" * 100_000),
        ("x.json", b'{"a":' * 100_000),
        ("x.json", b'{"schema": ' + b"[" * 400 + b"]" * 400 + b"}"),
        ("x.json", b'{"markups": [{"type": ' + b"[" * 100 + b"]" * 100 + b"}]}"),
        ("x.json", b"{}"),
        ("x.json", b'{"schema": "vfix-plan/2"}'),
        ("x.json", b'{"schema": "vfix-plan/1", "frame": "RAS", "unit": "mm"}'),
        ("x.json", b'{"schema": "vfix-plan/1", "frame": "LPS", "unit": "mm", "points": [{"position": [1, 2]}]}'),
        ("x.json", b'{"schema": "vfix-plan/1", "frame": "LPS", "unit": "mm", "name": "a\\u0000b"}'),
        ("x.json", b'{"schema": "vfix-plan/1", "frame": "LPS", "unit": "mm", "tool": "../../x"}'),
        ("x.json", b'{"schema": "vfix-plan/1", "frame": "LPS", "unit": "mm", "settings": {"margin_mm": "a"}}'),
        ("x.json", markups()),
        ("x.json", markups(curve(), curve())),
        ("x.json", markups({"type": "ROI"})),
        ("x.json", markups(curve(type="ClosedCurve"), curve(type="Fiducial"))),
        ("x.json", markups(curve(coordinateUnits="inch"))),
        ("x.json", markups(curve(coordinateSystem="IJK"))),
        ("x.json", markups(curve(controlPoints=[{"position": [1, 2, True]}]))),
        ("x.json", markups(curve(controlPoints=[{"position": [1, 2, 1e9]}]))),
        ("x.json", markups(curve(controlPoints=[{"position": [1, 2, 3], "positionStatus": "undefined"}]))),
        ("x.json", markups(curve(controlPoints=[{"position": [1, 2, 3], "label": {"a": 1}}]))),
        ("x.csv", b"# frame=LPS\nlabel,x,y,z\na,1,2,3\n"),
        ("x.csv", b"# frame=LPS\n# unit=mm\nlabel,x,y,z\na,1,2\n"),
        ("x.csv", b"# frame=LPS\n# unit=mm\nlabel,x,y,z\na,1,2,nan\n"),
        ("x.csv", b"# frame=LPS\n# unit=mm\nkind,label,x,y,z\nbone,a,1,2,3\n"),
        ("x.csv", b'# frame=LPS\n# unit=mm\nlabel,x,y,z\n"a,1,2,3\n'),
        ("x.csv", b"# frame=LPS\n# unit=mm\n# name=" + b"[" * 100_000 + b"\nlabel,x,y,z\na,1,2,3\n"),
        ("x.csv", b"# frame=LPS\n# unit=mm\n# name=" + b"[" * 500 + b"]" * 500 + b"\nlabel,x,y,z\na,1,2,3\n"),
        ("x.csv", b""),
        ("x.fcsv", b"1,2,3\n"),
        ("x.fcsv", b"# Markups fiducial file version = 4.11\n# columns = id,x,y,z,label\n1,2,3,4,a\n"),
        ("x.txt", b"hello"),
    ],
)
def test_broken_files_are_refused_with_words(name: str, data: bytes) -> None:
    with pytest.raises(InputError) as refusal:
        read_plan(name, data)
    assert len(str(refusal.value)) > 10


def test_a_file_is_as_deep_as_we_say_wherever_it_is_read() -> None:
    """Not as deep as the stack that is left: the same file is read, or refused in words, from any depth of calls."""

    def read(depth: int, nested: int) -> object:
        return read(depth - 1, nested) if depth else parse_json("[" * nested + "]" * nested)

    for depth in (0, 500):
        read(depth, MAX_DEPTH)
        with pytest.raises(ValueError, match="nested more than 64"):
            read(depth, MAX_DEPTH + 1)


@pytest.mark.parametrize(
    ("name", "data", "where"),
    [
        ("x.csv", b"# frame=LPS\n# unit=mm\nlabel,x,y,z\na,1,2,3\n# note\nb,1,2\n", "line 6 of the table"),
        ("x.csv", b"# frame=LPS\n# unit=mm\nlabel,x,y,z\na,1,2,x\n", "line 4 of the table: 'x' is not"),
        (
            "x.csv",
            b"# frame=LPS\n# unit=mm\nkind,label,x,y,z\n\nbone,a,1,2,3\n",
            "line 5 of the table: this is a 'bone'",
        ),
        ("x.csv", b'# frame=LPS\n# unit=mm\nlabel,x,y,z\na,1,2,3\n"b,1,2,3\n', "line 5 of the table is damaged"),
        ("x.fcsv", SLICER + b"1,2,3,4,a\n2,2,3,,b\n", "line 5 of the point list: '' is not"),
        ("x.fcsv", SLICER + b'1,2,3,4,a\n2,2,3,4,"b\n', "line 5 of the point list: it is damaged"),
        ("x.fcsv", SLICER + b"1,2\n", "line 4 of the point list: it has 2 cells for 5 columns"),
        ("x.csv", LPS + b"# frame=RAS\na,1,2,3\n", "line 4: .*frame=RAS.* after frame=LPS"),
        ("x.csv", b"# frame=LPS\n# unit=mm\n# Unit = m\nlabel,x,y,z\na,1,2,3\n", "line 3: .*Unit=m.* after unit=mm"),
        ("x.csv", LPS + b"a,1,2,3\n# frame=RAS\nb,1,2,3\n", "line 5: .*frame=RAS.* below the first point"),
        ("x.csv", LPS + b"a,1,2,3\n# unit=mm\n", "line 5: .*unit=mm.* below the first point"),
        ("x.fcsv", SLICER + b"# CoordinateSystem = RAS\n1,2,3,4,a\n", "line 4: .*RAS.* after CoordinateSystem=LPS"),
        ("x.fcsv", SLICER + b"1,2,3,4,a\n" + SLICER, "line 5: .* below the first point"),
        ("x.csv", LPS + b"a,1,2,3.2", "the last line may be incomplete.* add a line break"),
        ("x.fcsv", SLICER + b"1,2,3,4,a", "the last line may be incomplete"),
        ("x.json", markups(curve(controlPoints=[{"position": [1, 2, 3]}, {"position": [1, 2]}])), "control point 2: "),
        (
            "x.json",
            markups(curve(controlPoints=[{"position": [1, 5, 2, 5, 3, 5]}])),
            "control point 1: .* decimal commas",
        ),
        ("x.csv", LPS + b"a,1,2,3\nb,12,5,-60,25,1,5\n", "line 5 of the table: it has 7 cells .* decimal commas"),
        ("x.csv", LPS + b"skull, left,12.5,-60.25,1.5\n", "line 4 of the table: it has 5 cells .* comma in a label"),
        ("x.csv", LPS + b"skull, left,12,60,1\n", "line 4 of the table: it has 5 cells .* comma in a label"),
        ("x.csv", LPS + b"a,1,2,3,\n", "line 4 of the table: it has 5 cells for 4 columns"),
        ("x.csv", LPS + b'a,"12,5",2,3\n', "line 4 of the table: '12,5' is not a coordinate; .* not a comma"),
        ("x.csv", LPS.replace(b",", b";") + b"a;12,5;2;3\n", "line 4 .*: '12,5' is not a coordinate; .* not a comma"),
        ("x.csv", LPS.replace(b",", b"\t") + b"a\tleft\t1\t2\t3\n", "line 4 .* a tab in a label"),
        ("x.fcsv", WIDE + b"1,12,5,-60,25,1,5,0,0,0,1,1,1,0,F-1,,\n", "line 4 of .*it has 17 cells .* decimal commas"),
        ("x.fcsv", WIDE + b"1,1.5,2,3,0,0,0,1,1,1,0,F, 1,,\n", "line 4 of the .*it has 15 cells .* comma in a label"),
        ("x.fcsv", WIDE + b"1,12,5,-60,7,0,0,0,1,1,1,0,F-1,\n", "line 4 of the point list: .* cells are moved"),
        ("x.fcsv", WIDE + b"1,12,5,1,0,0,0,1,1,1,0,F-1,,\n2,1.5,2,3,0,0,0,1,1,1,0,F-1,\n", "line 5 of .*13 cells"),
    ],
)
def test_an_error_says_where_it_is(name: str, data: bytes, where: str) -> None:
    """The line of the file as an editor counts it, comments and empty lines included."""
    with pytest.raises(PlanError, match=f"^{where}"):
        read_plan(name, data)


LONG = {"um": "micrometer", "µm": "Micrometre", "mm": "millimeters", "m": "metre"}


@pytest.mark.parametrize(("unit", "per_mm"), [("um", 1e3), ("µm", 1e3), ("mm", 1.0), ("m", 1e-3)])
def test_the_unit_of_a_file_comes_before_its_range(unit: str, per_mm: float) -> None:
    """A head in micrometres is farther than any head if its numbers are taken for millimetres."""
    wanted = (120.5, -60.25, 1500.0)
    place = [x * per_mm for x in wanted]
    table = f"# frame=LPS\n# unit={unit}\nlabel,x,y,z\na,{','.join(map(repr, place))}\n".encode()
    nodes = [
        curve(coordinateUnits=one, controlPoints=[{"position": place}])
        for one in (unit, [unit] * 3, [unit, "UCUM", LONG[unit]])
    ]
    for name, data in [("a.csv", table), *(("a.mrk.json", markups(node)) for node in nodes)]:
        assert read_plan(name, data, "LPS").content.points[0].position == pytest.approx(wanted)
    measured = table.replace(b"frame=LPS", b"frame=patient")
    assert read_measured(measured, RegistrationContent())[0].position == pytest.approx(wanted)


@pytest.mark.parametrize(
    "units",
    [["mm", "mm", "um"], ["um", "mm", "mm"], [], ["mm", 1, "mm"], ["inch"] * 3, None, ["um", "UCUM", "millimeter"]],
)
def test_units_that_differ_or_are_not_known_are_refused(units: object) -> None:
    with pytest.raises(FrameError, match="the file's unit"):
        read_plan("a.mrk.json", markups(curve(coordinateUnits=units)))
    with pytest.raises(FrameError, match="the file's units are mm, mm, m"):
        read_plan("x.csv", LPS.replace(b"unit=mm", b"unit=mm, mm, m") + b"a,1,2,3\n")


def test_files_of_reports_with_commas_and_micrometres(trial_data: Path) -> None:
    folder = trial_data / "reports"
    with pytest.raises(PlanError, match="17 cells for 14 columns, as where decimal commas"):
        read_plan("a.fcsv", (folder / "01_decimal_comma.fcsv").read_bytes(), None, "targets")
    for name in ("14_um.csv", "14_um.mrk.json"):
        points = read_plan(name, (folder / name).read_bytes()).content.points
        assert [point.position for point in points] == [(0.0, -60.0, 0.0), (0.0, -45.0, 2.0)]


def test_what_a_table_says_again_and_other_comments_change_nothing() -> None:
    table = LPS.replace(b"label", b"# unit=mm\n# by=A\n# by=B\nlabel") + b"# unit = mm\na,1,2,3\n# by=C\n"
    assert read_plan("x.csv", table).content.points[0].position == (1, 2, 3)


@pytest.mark.parametrize("label", ["\u200b", " ", "\u3164", "\u2800"])
def test_a_label_of_invisible_characters_alone_is_refused(label: str) -> None:
    """It may be empty, which shows; a plan that was stored with one is read and can be mended."""
    point = {"position": [1, 2, 3], "label": label}
    plan = json.loads(export_text(PLAN, "json")) | {"points": [point]}
    for data in (markups(curve(controlPoints=[point])), json.dumps(plan).encode()):
        with pytest.raises(InputError, match="label is invisible"):
            read_plan("x.json", data)
    assert content_from_json(plan).points[0].label == label


def test_files_beyond_measure_are_refused() -> None:
    with pytest.raises(TooLarge):
        read_plan("x.json", b" " * ((16 << 20) + 1))
    point = {"position": [1, 2, 3]}
    with pytest.raises(TooLarge):
        read_plan("x.json", markups(curve(controlPoints=[point] * (MAX_POINTS + 1))))


def test_files_of_other_programs_are_read_or_refused(trial_data: Path) -> None:
    broken = trial_data / "formats" / "malformed"

    def read(path: Path) -> tuple[PlanPoint, ...]:
        return read_plan(path.name, path.read_bytes(), points_as="path").content.points

    expected = (PlanPoint("", "P-1", (-24.6, -99.4, -7.5)), PlanPoint("", "P-2", (-23.0, -28.0, -20.2)))
    for name in ("ok_v4.6_RAS_numeric.fcsv", "ok_v4.11_LPS.fcsv"):
        assert_same(read(broken / name), expected)
    assert read(broken / "ras.mrk.json")[0].position == (-1, -2, 3)
    for name in ("nan_position.mrk.json", "truncated.mrk.json"):
        with pytest.raises(PlanError):
            read(broken / name)
    with pytest.raises(FrameError):
        read(broken / "no_coordinate_system.mrk.json")
    assert len(read(trial_data / "formats" / "markups" / "slicer_doc_example.mrk.json")) == 3
    corridor = read(trial_data / "head_ct" / "corridor.mrk.json")
    assert (len(corridor), corridor[0].position) == (12, (-29.5, -101.8, -14.0))
    targets = trial_data / "head_ct" / "targets.mrk.json"
    assert [t.label for t in read_targets(targets.name, targets.read_bytes())] == [
        "sphenoid_sinus",
        "maxillary_sinus_image_left",
    ]
