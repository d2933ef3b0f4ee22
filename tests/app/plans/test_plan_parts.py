"""Several paths, shaft directions, protected structures and bone to remove: kept, undone and exchanged."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from plan_editor import PlanEditor
from sqlalchemy import select

from app.cases.service import Case
from app.exchange.plan_files import FORMATS, export_text, from_native_json, read_plan
from app.kit.errors import NotFound, PlanConflict, PlanLocked, TooLarge
from app.plans.diff import changes
from app.plans.document import BEFORE_PATHS, PLAN, STORED
from app.plans.model import MAX_NOTES, PlanContent, PlanPath, PlanPoint, check_stored, drive_parts
from app.plans.operations.document import LockPlan, RedoPlan, SetNotes, UndoPlan
from app.plans.operations.instruments import ChooseTool, KeepPlacement, ToolChoice
from app.plans.operations.paths import AddPath, ChoosePath, DeletePath, RenamePath, SetEntrySide, SetShaft
from app.plans.operations.points import AddPoint
from app.plans.operations.removed_bone import AddBone, ChangeBone, DeleteBone
from app.plans.operations.zones import AddZone, ChangeZone, DeleteZone
from app.plans.paths import MAX_PATHS, Midplane, ends_words, side_caution
from app.plans.service import Plan, PlanService
from app.plans.zones import MAX_ZONES, PlanZone, RemovedBone
from app.store import Store
from app.store.models import DocumentStateRow
from vfix_engine.errors import InputError, PlanError

SPHERE: dict[str, Any] = {"kind": "sphere", "centre": [1.0, 2.0, 3.0], "radius": 4.0}
EYE = [float(i % 5 == 0) for i in range(16)]
SHAPES: list[dict[str, Any]] = [
    SPHERE,
    {"kind": "capsule", "start": [0.0, 0.0, 0.0], "end": [1 / 3, 0.0, 9.0], "radius": 1.5},
    {"kind": "capsules", "points": [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 5.0, 0.0]], "radius": 1.0},
    {"kind": "box", "transform_box_to_patient": EYE, "half_size": [1.0, 2.0, 3.0]},
    {"kind": "half_space", "point": [0.0, 0.0, 40.0], "normal": [0.0, 0.0, -1.0]},
    {"kind": "patch", "centre": [1.0, 2.0, 3.0], "radius": 5.0},
    {"kind": "patch", "centre": [1.0, 2.0, 3.0], "radius": 5.0, "structure": "bone"},
    {"kind": "structure", "structure": "optic-nerve"},
]
PLACED = {"name": "steady_hand", "base": EYE, "q_start": [0.0] * 7}


@pytest.fixture
def plan(plans: PlanService, case: Case) -> Plan:
    return plans.create(case.id, "Corridor")


@pytest.fixture
def editor(plans: PlanService, plan: Plan) -> PlanEditor:
    return PlanEditor(plans, plan.id)


def full_content() -> PlanContent:
    """A content with everything in it, the second of its three paths chosen."""
    points = tuple(
        PlanPoint(f"p-{n}", f"P{n}", (float(n), 0.5, 1 / 3), (0.0, 0.6, 0.8), None if n else 30.0) for n in range(3)
    )
    others = tuple(replace(point, id=f"q-{point.id}") for point in points)
    paths = (
        PlanPath("left", "Left nostril", others, "straight_pointer", {}, "left"),
        PlanPath("right", "Right nostril", points, "bent_30", {"bend_deg": 25.0}, "right"),
        PlanPath("spare", "Spare"),
    )
    zones = tuple(PlanZone(f"z-{n}", f"zone {n}", shape, 1.0 + n / 7) for n, shape in enumerate(SHAPES))
    soft = PlanZone("z-soft", "turbinate", SPHERE, 0.0, "soft", 0.4, 2.5, "#aabbcc", False)
    capsule = RemovedBone("b-1", "septum", SHAPES[1])
    return PlanContent(
        targets=(PlanPoint("t", "T1", (1.0, 1.0, 1.0)),),
        robot=PLACED,
        settings={"margin_mm": 0.4},
        path_id="right",
        paths=paths,
        zones=(*zones, soft),
        removed_bone=(capsule, RemovedBone("b-2", "ethmoid", SHAPES[3])),
        notes="First line\nsecond ♥",
    )


def test_everything_comes_back_from_a_file_and_from_the_store(plans: PlanService, case: Case, plan: Plan) -> None:
    content = check_stored(full_content())
    whole = plans.create(case.id, "Whole", content)
    assert plans.get(whole.id).content == content
    assert [len(path.points) for path in whole.content.paths] == [3, 3, 0]
    assert (whole.content.path.name, whole.content.entry_side) == ("Right nostril", "right")
    assert from_native_json(export_text(whole, "json")).content == content


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_has_the_points_of_the_chosen_path(plans: PlanService, case: Case, form: str) -> None:
    whole = plans.create(case.id, "Whole", full_content())
    read = read_plan(f"plan.{form}", export_text(whole, form).encode()).content  # type: ignore[arg-type]
    assert [point.position for point in read.points] == [point.position for point in whole.content.points]
    assert [point.position for point in read.targets] == [(1.0, 1.0, 1.0)]


def test_a_file_has_the_chosen_path_where_older_programs_read_it() -> None:
    """The keys of vfix-plan/1 are those of the chosen path, which does not stand in the file a second time."""
    whole = PLAN.draft("case-1", "ab" * 32, "Whole", full_content())
    data = json.loads(export_text(whole, "json"))
    assert data["schema"] == "vfix-plan/1"
    assert [point["position"] for point in data["points"]] == [[n, 0.5, 1 / 3] for n in range(3)]
    assert (data["tool"], data["tool_shape"], data["robot"]) == ("bent_30", {"bend_deg": 25.0}, PLACED)
    assert [set(path) & {"points", "tool"} for path in data["paths"]] == [{"points", "tool"}, set(), {"points", "tool"}]
    data["points"][0]["position"] = [7.0, 8.0, 9.0]  # as a program does that knows the old keys only
    assert from_native_json(json.dumps(data)).content.path.points[0].position == (7.0, 8.0, 9.0)


def test_a_file_from_before_has_one_path() -> None:
    data = {
        "schema": "vfix-plan/1", "frame": "LPS", "unit": "mm", "name": "Old", "case_hash": "ab" * 32,
        "points": [{"id": "a", "label": "P1", "position": [1, 2, 3]}], "targets": [], "tool": "straight_pointer",
        "tool_shape": {}, "robot": {"name": "steady_hand", "base": None, "q_start": None}, "settings": {},
    }  # fmt: skip
    content = from_native_json(json.dumps(data)).content
    point = PlanPoint("a", "P1", (1.0, 2.0, 3.0))
    assert content.paths == (PlanPath("path-1", "Path 1", (point,), "straight_pointer"),)
    assert (content.zones, content.removed_bone, content.notes) == ((), (), "")


def test_a_content_that_was_stored_before_has_one_path(store: Store, plans: PlanService, plan: Plan) -> None:
    """A state of the older schema is brought up; a newer one would be refused by an older vfix."""
    editor = PlanEditor(plans, plan.id)
    editor.do(AddPoint(position=(1, 2, 3)))
    with store.writing() as session:
        for row in session.scalars(select(DocumentStateRow).where(DocumentStateRow.document_id == plan.id)):
            assert row.schema == STORED
            new = ("path_id", "paths", "zones", "removed_bone", "notes")
            row.content = {key: value for key, value in row.content.items() if key not in new}
            row.schema = BEFORE_PATHS
    read = PlanService(store).get(plan.id)
    assert [(path.id, path.name, len(path.points)) for path in read.content.paths] == [("path-1", "Path 1", 1)]
    assert (read.schema, plans.do(plan.id, UndoPlan()).content.points) == (STORED, ())


NUMBERS = st.floats(-200, 200)
PLACES = st.tuples(NUMBERS, NUMBERS, NUMBERS)
DIRECTIONS = PLACES.filter(lambda v: math.hypot(*v) > 1e-3) | st.none()


@hypothesis_settings(max_examples=60, deadline=None, derandomize=True)
@given(
    st.lists(st.tuples(PLACES, DIRECTIONS, st.floats(-360, 360) | st.none()), max_size=5),
    st.lists(st.tuples(st.sampled_from(SHAPES), st.floats(0, 20), st.booleans()), max_size=5),
    st.text(st.characters(categories=["L", "N", "P", "S", "Zs"]) | st.just("\n"), max_size=40),
    st.integers(0, 2),
)
def test_any_content_comes_back(
    rows: list[tuple[Any, Any, Any]], regions: list[tuple[dict[str, Any], float, bool]], notes: str, chosen: int
) -> None:
    points = [PlanPoint(f"p-{n}", "", place, to, roll if to else None) for n, (place, to, roll) in enumerate(rows)]
    paths = tuple(PlanPath(f"w{n}", f"Way {n}") for n in range(3))
    zones = tuple(
        PlanZone(f"z{n}", f"Zone {n}", shape, margin, "soft" if soft else "hard", 0.5 if soft else None)
        for n, (shape, margin, soft) in enumerate(regions)
    )
    wanted = PlanContent(paths=paths, path_id=f"w{chosen}", zones=zones, notes=notes).with_points(points)
    plan = PLAN.draft("case-1", "ab" * 32, "Any", wanted)
    once = from_native_json(export_text(plan, "json")).content
    assert once.zones == wanted.zones
    assert (once.notes, once.path_id, len(once.paths)) == (notes, f"w{chosen}", 3)
    for read, given_point in zip(once.points, points, strict=True):
        assert (read.position, read.roll_deg) == (given_point.position, given_point.roll_deg)
        if read.direction is not None and given_point.direction is not None:
            length = math.hypot(*given_point.direction)
            assert read.direction == pytest.approx([x / length for x in given_point.direction], abs=1e-12)
    again = replace(plan, content=once)
    assert from_native_json(export_text(again, "json")).content == once


def test_a_field_is_stored_exported_and_told_by_its_declaration_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True, kw_only=True)
    class More(PlanContent):
        surgeon: str = ""
        steps: tuple[int, ...] = ()

    monkeypatch.setattr("app.plans.model.PlanContent", More)
    more = More(surgeon="A. Mace", steps=(1, 2), notes="x")
    assert from_native_json(export_text(PLAN.draft("case-1", "", "More", more), "json")).content == more
    assert PLAN.content(STORED, json.loads(json.dumps(PLAN.write(more))), {}) == more
    assert PLAN.content(STORED, PLAN.write(PlanContent(notes="x")), {}) == More(notes="x")
    with pytest.raises(PlanError, match="surgeon"):
        PLAN.content(STORED, {**PLAN.write(more), "surgeon": 3}, {})
    told = ("The notes were changed.", "Surgeon: ‘A. Mace’ instead of ‘’.", "Steps: changed.")
    assert changes(More(), more) == told


def test_paths_are_added_chosen_renamed_and_deleted(editor: PlanEditor) -> None:
    editor.do(AddPoint(position=(1, 2, 3)))
    editor.do(ChooseTool(tool=ToolChoice("straight_pointer")))
    first = editor.plan.content.path_id
    plan = editor.do(AddPath(copy_of=first))
    second = plan.content.path_id
    assert [path.name for path in plan.content.paths] == ["Path 1", "Path 2"]
    assert (plan.content.path_id, plan.content.points[0].position) == (second, (1.0, 2.0, 3.0))
    assert plan.content.points[0].id != plan.content.paths[0].points[0].id
    editor.do(ChooseTool(tool=ToolChoice("endoscope_30")))
    editor.do(AddPoint(position=(4, 5, 6)))
    assert [(path.tool, len(path.points)) for path in editor.plan.content.paths] == [
        ("straight_pointer", 1),
        ("endoscope_30", 2),
    ]
    editor.do(RenamePath(path_id=second, name="Right"))
    editor.do(SetEntrySide(path_id=second, entry_side="right"))
    plan = editor.do(ChoosePath(path_id=first))
    assert (plan.content.tool, len(plan.content.points), plan.content.entry_side, plan.content.paths[1].entry_side) == (
        "straight_pointer",
        1,
        "",
        "right",
    )
    plan = editor.do(DeletePath(path_id=first))
    assert [(path.name, path.id) for path in plan.content.paths] == [("Right", second)]
    with pytest.raises(PlanError, match="one path at least"):
        editor.do(DeletePath(path_id=second))
    with pytest.raises(NotFound):
        editor.do(RenamePath(path_id=first, name="Gone"))
    refused: dict[str, Callable[[], object]] = {
        "side": lambda: editor.do(SetEntrySide(path_id=second, entry_side="up")),
        "same name": lambda: editor.do(AddPath(name="Right")),
        "no path": lambda: editor.do(ChoosePath(path_id="nobody")),
    }
    for wrong, call in refused.items():
        with pytest.raises(PlanError, match=wrong):
            call()


def test_a_placing_belongs_to_the_path_that_it_was_made_for(editor: PlanEditor) -> None:
    point_id = editor.add(AddPoint(position=(1, 2, 3)))
    editor.do(KeepPlacement(robot=PLACED))
    assert editor.do(RenamePath(path_id=editor.plan.content.path_id, name="Left")).content.robot == PLACED
    assert editor.do(SetShaft(point_id=point_id, direction=(0, 0, 2), roll_deg=10.0)).content.robot["base"] is None
    assert (editor.plan.content.points[0].direction, editor.plan.content.points[0].roll_deg) == ((0.0, 0.0, 1.0), 10.0)
    editor.do(KeepPlacement(robot=PLACED))
    assert editor.do(AddPath()).content.robot["base"] is None


def test_zones_and_bone_are_edited(editor: PlanEditor) -> None:
    nerve = editor.add(AddZone(shape=SHAPES[2], name="optic nerve"))
    soft = editor.add(AddZone(shape=SPHERE, kind="soft", max_depth_mm=1.5))
    plan = editor.plan
    assert [zone.name for zone in plan.content.zones] == ["optic nerve", "Structure 1"]
    assert (plan.content.zones[1].stiffness_n_per_mm, plan.content.zones[1].max_depth_mm) == (0.5, 1.5)
    assert plan.content.zones[0].colour != plan.content.zones[1].colour
    plan = editor.do(ChangeZone(zone_id=soft, kind="hard", margin_mm=2, colour="#ABCDEF", visible=False))
    assert plan.content.zones[1] == PlanZone(soft, "Structure 1", SPHERE, 2.0, colour="#abcdef", visible=False)
    region = editor.add(AddBone(shape=SPHERE))
    assert (
        editor.do(ChangeBone(region_id=region, name="Sphenoid front")).content.removed_bone[0].name == "Sphenoid front"
    )
    assert editor.do(DeleteZone(zone_id=nerve)).content.zones == plan.content.zones[1:]
    assert editor.do(DeleteBone(region_id=region)).content.removed_bone == ()
    with pytest.raises(NotFound):
        editor.do(DeleteZone(zone_id=nerve))
    with pytest.raises(NotFound):
        editor.do(ChangeBone(region_id=region, name="x"))
    with pytest.raises(PlanError, match="what is to change"):
        editor.do(ChangeZone(zone_id=soft))
    with pytest.raises(PlanError, match="needs its margin_mm"):
        editor.do(ChangeZone(zone_id=soft, margin_mm=None))


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"shape": {"kind": "cone"}}, "kind of a shape"),
    ({"shape": {"kind": "sphere", "centre": [1, 2, 3]}}, "needs 'radius'"),
    ({"shape": {**SPHERE, "radius": -1}}, "more than 0"),
    ({"shape": {**SPHERE, "radius": 1e-9}}, "'eye' is too small: 1e-09 mm; .* 0.01 mm at least"),
    ({"shape": {**SHAPES[2], "radius": 0.0099}}, "too small: 0.0099 mm"),
    ({"shape": {**SHAPES[3], "half_size": [1.0, 1e-300, 2.0]}}, "too small"),
    ({"shape": {**SPHERE, "size": 1}}, "has no 'size'"),
    ({"shape": {**SPHERE, "centre": [1, 2, "3"]}}, "must be a number"),
    ({"shape": {**SHAPES[3], "transform_box_to_patient": [2.0] * 16}}, "transform"),
    ({"shape": {**SHAPES[4], "normal": [0, 0, 0]}}, "no direction"),
    ({"shape": {"kind": "capsules", "points": [], "radius": 1}}, "1 to 32 points"),
    ({"margin_mm": 21}, "margin is 21 mm"),
    ({"margin_mm": math.nan}, "finite"),
    ({"kind": "springy"}, "hard or soft"),
    ({"stiffness_n_per_mm": 1.0}, "belong to a soft one"),
    ({"kind": "soft", "stiffness_n_per_mm": 0}, "more than 0"),
    ({"kind": "soft", "max_depth_mm": 30}, "allowed is 0 to 20"),
    ({"colour": "red"}, "#rrggbb"),
    ({"name": "a\u202eb"}, "control character"),
]


@pytest.mark.parametrize(("fields", "words"), WRONG)
def test_a_wrong_zone_is_refused_and_nothing_changes(editor: PlanEditor, fields: dict[str, Any], words: str) -> None:
    zone_id = editor.add(AddZone(shape=SPHERE, name="eye"))
    plan = editor.plan
    with pytest.raises(InputError, match=words):
        editor.do(ChangeZone(zone_id=zone_id, **fields))
    assert editor.plan == plan


def test_a_number_that_is_none_is_never_stored_as_left_open(plans: PlanService, case: Case) -> None:
    """A greatest depth or a roll that is NaN would be a guard that is not there (HAZ-05)."""
    soft = PlanZone("z", "eye", SPHERE, kind="soft", max_depth_mm=1.0)
    point = PlanPoint("p", "P1", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0), 5.0)
    for bad in (math.nan, math.inf, -math.inf):
        for content in (
            PlanContent(zones=(replace(soft, max_depth_mm=bad),)),
            PlanContent(zones=(replace(soft, stiffness_n_per_mm=bad),)),
            PlanContent(settings={"margin_mm": bad}),
            PlanContent().with_points([replace(point, roll_deg=bad)]),
        ):
            with pytest.raises(InputError, match=r"finite|margin_mm"):
                plans.create(case.id, "Bad", content)
    assert plans.list(case.id) == ()


def test_a_shape_has_a_least_size_that_a_stored_one_need_not_have(plans: PlanService, case: Case) -> None:
    for radius in (0.01, 200.0):
        plan = plans.create(case.id, "Sized", PlanContent(zones=(PlanZone("z", "eye", {**SPHERE, "radius": radius}),)))
        assert plan.content.zones[0].shape["radius"] == radius
    tiny = PlanContent(removed_bone=(RemovedBone("b", "wall", {**SPHERE, "radius": 0.001}),))
    assert check_stored(tiny) == tiny
    with pytest.raises(PlanError, match=r"'wall' is too small: 0\.001 mm"):
        plans.create(case.id, "Tiny", tiny)


def test_a_region_of_bone_is_a_solid(editor: PlanEditor) -> None:
    for shape in (*SHAPES[4:], SHAPES[2]):
        with pytest.raises(PlanError, match="known are sphere, capsule, box"):
            editor.do(AddBone(shape=shape))


def test_too_much_is_refused(plans: PlanService, case: Case, editor: PlanEditor) -> None:
    zones = tuple(PlanZone(f"z{n}", f"z{n}", SPHERE) for n in range(MAX_ZONES + 1))
    with pytest.raises(PlanError, match="too many"):
        plans.create(case.id, "Many", PlanContent(zones=zones))
    paths = tuple(PlanPath(f"w{n}", f"w{n}") for n in range(MAX_PATHS + 1))
    with pytest.raises(TooLarge, match="paths"):
        plans.create(case.id, "Many", PlanContent(paths=paths, path_id="w0"))
    with pytest.raises(InputError, match="10,001 characters"):
        editor.do(SetNotes(notes="a" * (MAX_NOTES + 1)))
    with pytest.raises(InputError, match="control character"):
        editor.do(SetNotes(notes="a\x00b"))
    with pytest.raises(PlanError, match="same name"):
        plans.create(case.id, "Twice", PlanContent(paths=(PlanPath("a", "A"), PlanPath("b", "A")), path_id="a"))


def test_every_edit_is_undone_redone_locked_and_in_conflict(editor: PlanEditor) -> None:
    """HAZ-24: every edit goes over the one history, with the plan's revision and its lock."""
    point_id = editor.add(AddPoint(position=(1, 2, 3)))
    zone_id = editor.add(AddZone(shape=SPHERE, name="eye"))
    region = editor.add(AddBone(shape=SPHERE))
    edits: list[Callable[..., object]] = [
        lambda **o: editor.do(AddPath(name="Second"), **o),
        lambda **o: editor.do(RenamePath(path_id=editor.plan.content.path_id, name="Third"), **o),
        lambda **o: editor.do(SetEntrySide(path_id=editor.plan.content.path_id, entry_side="left"), **o),
        lambda **o: editor.do(ChoosePath(path_id="path-1"), **o),
        lambda **o: editor.do(SetShaft(point_id=point_id, direction=(1, 0, 0)), **o),
        lambda **o: editor.do(SetNotes(notes="careful"), **o),
        lambda **o: editor.do(AddZone(shape=SPHERE), **o),
        lambda **o: editor.do(ChangeZone(zone_id=zone_id, margin_mm=2.0), **o),
        lambda **o: editor.do(DeleteZone(zone_id=zone_id), **o),
        lambda **o: editor.do(ChangeBone(region_id=region, name="other"), **o),
        lambda **o: editor.do(DeleteBone(region_id=region), **o),
        lambda **o: editor.do(DeletePath(path_id=editor.plan.content.path_id), **o),
    ]
    for edit in edits:
        before = editor.plan
        with pytest.raises(PlanConflict):
            edit(expected_revision=before.revision - 1)
        editor.do(LockPlan(locked=True))
        with pytest.raises(PlanLocked):
            edit()
        editor.do(LockPlan(locked=False))
        edit(expected_revision=editor.revision)
        after = editor.plan.content
        assert after != before.content
        assert editor.do(UndoPlan()).content == before.content
        assert editor.do(RedoPlan()).content == after


def test_what_changes_a_drive_changes_its_key() -> None:
    content = check_stored(full_content())
    other = replace(content.points[0], direction=(1.0, 0.0, 0.0))
    changing: list[dict[str, Any]] = [
        {"zones": content.zones[1:]},
        {"zones": (replace(content.zones[0], margin_mm=3.0), *content.zones[1:])},
        {"zones": (replace(content.zones[0], name="other"), *content.zones[1:])},
        {"removed_bone": ()},
    ]
    placed = {"robot": content.robot}
    others = [content.with_points((other, *content.points[1:])), content.with_tool("straight_pointer")]
    for changed in (*(replace(content, **change) for change in changing), *(replace(one, **placed) for one in others)):
        assert drive_parts(changed) != drive_parts(content)
    quiet: list[dict[str, Any]] = [
        {"notes": "other"},
        {"targets": ()},
        {"zones": (replace(content.zones[0], colour="#000000", visible=False), *content.zones[1:])},
        {"paths": (*content.paths[:2], replace(content.paths[2], name="other"))},
    ]
    for change in quiet:
        assert drive_parts(replace(content, **change)) == drive_parts(content)


def test_a_plan_is_taken_along_another_path(plans: PlanService, case: Case) -> None:
    plan = plans.create(case.id, "Whole", full_content())
    left = replace(plan, content=plan.content.along("Left nostril"))
    assert (left.content.path_id, left.content.tool, left.content.robot["base"]) == ("left", "straight_pointer", None)
    assert left.content.paths == plan.content.paths
    assert plan.content.along("right") == plan.content
    with pytest.raises(PlanError, match="'Left nostril', 'Right nostril', 'Spare'"):
        plan.content.along("middle")


def test_a_damaged_file_is_refused_with_the_reason() -> None:
    whole = PLAN.draft("case-1", "ab" * 32, "Whole", full_content())
    good = json.loads(export_text(whole, "json"))
    chosen = {**good["paths"][1], "points": []}
    for change, words in (
        ({"path_id": "nobody"}, "no path 'nobody'"),
        ({"paths": [good["paths"][0], chosen, good["paths"][2]]}, "leave them out"),
        ({"paths": {}}, "list of objects"),
        ({"zones": [{"id": "a", "name": "b"}]}, "missing required field shape"),
        ({"zones": [{**good["zones"][0], "sharp": 1}]}, "has no 'sharp'"),
        ({"removed_bone": 3}, "Expected array"),
        ({"notes": 3}, "Expected str"),
        ({"points": [{**good["points"][0], "direction": [0, 0, 0]}]}, "length"),
        ({"points": [{"id": "a", "label": "", "position": [1, 2, 3], "roll_deg": 4}]}, "give the direction"),
        ({"points": good["paths"][0]["points"]}, "same identifier"),
    ):
        with pytest.raises(InputError, match=words):
            from_native_json(json.dumps({**good, **change}))


@pytest.mark.parametrize("middle", [0.0, 20.0, -20.0])
@pytest.mark.parametrize(
    ("side", "left_mm", "words"),
    [
        (
            "right",
            6.0,
            "Entry is 6.0 mm left of the midline, not on the right. Check the side; the midline is x.",
        ),
        ("left", -2.5, "Entry is 2.5 mm right of the midline, not on the left."),
        ("right", 1.9, ""),
        ("left", 6.0, ""),
        ("right", -6.0, ""),
        ("midline", 6.0, ""),
        ("", 6.0, ""),
    ],
)
def test_an_entry_on_the_other_side_than_its_path_says_is_told(
    side: str, left_mm: float, words: str, middle: float
) -> None:
    midplane = Midplane((middle, 5.0, 9.0), (1.0, 0.0, 0.0), "x")
    path = PlanPath(points=(PlanPoint("p", "P1", (middle + left_mm, 0.0, 0.0)),), entry_side=side)  # type: ignore[arg-type]
    assert words in side_caution(path, midplane)
    assert bool(side_caution(path, midplane)) == bool(words)
    assert side_caution(PlanPath(entry_side="left"), midplane) == ""


def test_the_midplane_of_a_turned_head_is_turned() -> None:
    turned = Midplane((10.0, 0.0, 0.0), (0.8, 0.6, 0.0), "x")
    assert turned.left_mm((10.0 - 30.0 * 0.6, 30.0 * 0.8, 4.0)) == pytest.approx(0.0), "straight behind it"
    assert turned.left_mm((14.0, 3.0, 0.0)) == pytest.approx(5.0)


def test_a_path_says_how_far_before_the_nearest_target_it_ends() -> None:
    random = np.random.default_rng(3)
    path = [PlanPoint(f"p{n}", f"P{n}", tuple(random.uniform(-50, 50, 3))) for n in range(3)]
    targets = [PlanPoint(f"t{n}", f"T{n}", tuple(random.uniform(-50, 50, 3))) for n in range(20)]
    away = [math.dist(path[-1].position, one.position) for one in targets]
    nearest, least = targets[away.index(min(away))], min(away)
    assert ends_words(path, targets) == f"The path ends {least:.1f} mm before the nearest target, ‘{nearest.label}’."
    assert ends_words(path, [nearest]) == f"The path ends {least:.1f} mm before the target ‘{nearest.label}’."
    x, y, z = path[-1].position
    reached = PlanPoint("t", "ostium", (x + 0.3, y, z - 0.3))
    assert ends_words(path, [*targets, reached]) == "The path ends at the nearest target, ‘ostium’."
    assert ends_words(path, []) == ends_words(path[:1], targets) == ""
