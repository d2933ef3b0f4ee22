"""The task of study II: cutting along an arrow with hand-made rays, and Table IV of runs with known answers."""

import math
from pathlib import Path

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.command import BUTTON_CUT, COMMAND_SIZE, command_to_row, no_command
from vfix_engine.runtime.requests import Note, Reset
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.diathermy.labels import HALF_MM, Label, marker_on
from vfix_engine.study.diathermy.table import measured, task_note
from vfix_engine.study.diathermy.task import NEAR_MM, DiathermySample, DiathermyState, first_state, followed, stepped
from vfix_engine.study.lumen import score_lumen_run
from vfix_engine.study.polyps.task import surface_hash
from vfix_engine.worlds.snake.cavity import cavity_case

# Two labels that face −z, 40 mm ahead of a camera at the origin's height, 100 mm apart along x.
ONE = Label(np.array([0.0, 0.0, 40.0]), np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0]))
TWO = Label(np.array([100.0, 0.0, 40.0]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
LABELS = (ONE, TWO)
DT = 0.1


def plate(x: tuple[float, float], z: float) -> TriangleMesh:
    """A square wall across the cameras' axes between two places along x."""
    corners = [[x[0], -50.0, z], [x[1], -50.0, z], [x[1], 50.0, z], [x[0], 50.0, z]]
    return TriangleMesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))


BEHIND, BETWEEN = plate((-50.0, 150.0), 45.0), plate((0.2, 4.8), 20.0)  # the labels; cameras and the middle of one
seen = Wall(BEHIND).free


def over(x: float, y: float) -> np.ndarray:
    """A camera straight above a point, 40 mm before the labels."""
    camera = np.eye(4)
    camera[:2, 3] = x, y
    return camera


def looking(eye: tuple[float, float, float], at: tuple[float, float, float]) -> np.ndarray:
    """A camera at a point whose axis goes through another."""
    ahead = np.array(at) - eye
    ahead /= np.linalg.norm(ahead)
    side = np.cross([0.0, 1.0, 0.0], ahead)
    side /= np.linalg.norm(side)
    camera = np.eye(4)
    camera[:3, :3] = np.column_stack([side, np.cross(ahead, side), ahead])
    camera[:3, 3] = eye
    return camera


def along(first: float, last: float, step: float, across: float = 0.0, start_s: float = 0.0) -> list[DiathermySample]:
    """The marker along label one with the button held."""
    places = np.arange(first, last + 1e-9, step)
    return [DiathermySample(start_s + DT * n, over(float(x), across), True) for n, x in enumerate(places)]


def test_the_marker_is_where_the_optical_axis_meets_the_face_of_a_label() -> None:
    marker = marker_on(ONE, looking((-30.0, 0.0, 0.0), (6.0, 3.0, 40.0)))
    assert marker is not None
    assert (marker.along, abs(marker.across)) == pytest.approx((6.0, 3.0))
    assert marker.distance == pytest.approx(math.dist((-30.0, 0.0, 0.0), (6.0, 3.0, 40.0)))
    assert marker_on(ONE, over(16.4, 0.0)) is not None
    assert marker_on(ONE, over(16.6, 0.0)) is None  # beside the label, 33 mm across
    assert marker_on(ONE, looking((0.0, 0.0, 80.0), (0.0, 0.0, 40.0))) is None  # from behind
    assert marker_on(ONE, looking((0.0, 0.0, 0.0), (0.0, 0.0, -40.0))) is None  # away from it


def test_an_object_is_shortened_from_its_aimed_end_only_and_only_with_the_button() -> None:
    state = first_state(LABELS)
    for x in np.arange(-10.0, 10.1, 0.5):  # without the button
        state = stepped(LABELS, state, DiathermySample(0.0, over(float(x), 0.0), False), seen)
    assert state.labels[0].left_mm == 20.0
    assert (state.aimed, state.cutting) == (0, False)
    for x in (10.0, 5.0, 0.0, -7.9):  # from the other end, the middle, and not near enough
        state = stepped(LABELS, state, DiathermySample(0.0, over(x, 0.0), True), seen)
        assert (state.labels[0].left_mm, state.cutting, state.labels[0].began_s) == (20.0, False, None)
    state = stepped(LABELS, state, DiathermySample(0.0, over(-8.1, 0.0), True), seen)
    assert state.labels[0].left_mm == pytest.approx(18.1)
    assert state.cutting
    back = stepped(LABELS, state, DiathermySample(0.1, over(-9.5, 0.0), True), seen)
    assert back.labels[0].left_mm == pytest.approx(18.1)  # it does not grow again
    away = stepped(LABELS, back, DiathermySample(0.2, over(-8.1, NEAR_MM + 0.01), True), seen)
    assert not away.cutting
    assert away.labels[0].left_mm == pytest.approx(18.1)


def test_an_organ_between_the_camera_and_the_marker_stops_the_cutting() -> None:
    """It hides the marker from 0.5 to 4.5 mm along the arrow of label one, and the object waits there."""
    samples, state, cut = along(-10.0, 10.0, 0.5), first_state(LABELS), list[bool]()
    for sample in samples:
        state = stepped(LABELS, state, sample, Wall(BETWEEN).free)
        hidden = 0.0 < sample.camera[0, 3] < 5.0
        assert (state.aimed is None) == hidden
        cut.append(state.cutting)
    assert state.labels[0].end_mm == 0.0  # beyond the organ the marker is not near the object's end any more
    assert (state.traced, sum(cut)) == (0, 21)
    assert state.labels[0].held_s == pytest.approx(DT * 31)  # neither time nor errors count while it is hidden
    assert followed(LABELS, samples, Wall(BEHIND).free).traced == 1


def test_a_line_is_done_at_the_tip_of_its_arrow_and_the_next_one_tells_the_way_there() -> None:
    state = followed(LABELS, along(-10.0, 9.5, 0.5), seen)
    assert (state.traced, state.labels[0].done_s) == (0, None)
    assert state.labels[0].row()["time_s"] is None
    state = followed(LABELS, along(-10.0, 10.0, 0.5), seen)
    assert state.traced == 1
    assert state.labels[0].end_mm == HALF_MM
    row = state.labels[0].row()
    assert row["time_s"] == pytest.approx(40 * DT)
    assert row["distance_mm"] is None  # of the first
    way = [
        DiathermySample(10.0, over(100.0, -10.0), False),
        *(DiathermySample(11.0 + 0.1 * n, over(100.0, -10.0 + n), True) for n in range(21)),
    ]
    for sample in way:
        state = stepped(LABELS, state, sample, seen)
    assert state.done
    assert state.labels[1].row()["distance_mm"] == pytest.approx(math.hypot(90.0, 10.0))
    assert state.labels[1].row()["time_s"] == pytest.approx(2.0)


def test_errors_are_means_over_the_time_with_the_button_held() -> None:
    """1 mm beside the arrow from straight above: 1 mm, and the angle to the object's end, half a millimetre behind."""
    state = followed(LABELS, along(-10.0, 10.0, 0.5, across=1.0), seen)
    row = state.labels[0].row()
    assert row["line_error_mm"] == pytest.approx(1.0)
    assert row["angle_error_deg"] == pytest.approx(math.degrees(math.atan2(math.hypot(1.0, 0.5), 40.0)), rel=1e-6)
    idle = [DiathermySample(s.t, s.camera, n % 2 == 0) for n, s in enumerate(along(-10.0, 10.0, 0.25))]
    assert followed(LABELS, idle, seen).labels[0].row()["line_error_mm"] == pytest.approx(0.0, abs=1e-12)
    far = followed(LABELS, [*along(-10.0, 0.0, 0.5), DiathermySample(2.1, over(0.0, 8.0), True)], seen)
    assert far.labels[0].line_mm_s == pytest.approx(8.0 * DT)  # off the object, and on the label with the button held


def test_a_state_is_a_value_and_does_not_change() -> None:
    samples = along(-10.0, 10.0, 0.5)
    states = [first_state(LABELS)]
    for sample in samples:
        states.append(stepped(LABELS, states[-1], sample, seen))
    again = [first_state(LABELS)]
    for before, sample in zip(states, samples, strict=False):
        again.append(stepped(LABELS, before, sample, seen))
    assert again == states
    assert isinstance(hash(states[-1]), int)
    assert states[0] == DiathermyState(states[0].labels)


def recorded(folder: Path, note: Note) -> Run:
    """A straight robot looks along z at a label; its base is carried along the arrow, which a real one never is."""
    spec = cavity_case().script()
    writer = RunWriter(folder, spec, spec.columns, 1)
    writer.event("request", note)
    line = np.zeros(COMMAND_SIZE + len(spec.columns))
    names = [column.name for column in spec.columns]
    row = line[COMMAND_SIZE:]
    command = no_command()
    for n, x in enumerate(np.arange(-10.0, 10.01, 0.5)):
        command_to_row(type(command)(command.force, buttons=BUTTON_CUT), line)
        values = {"t": DT * n, "base_00": 1.0, "base_11": 1.0, "base_22": 1.0, "base_03": x, "base_13": 0.25}
        values |= {"base_23": -146.0, "tip_x": x, "beyond_bound": 0.2 if n == 3 else -1.0}
        for name, value in values.items():
            row[names.index(name)] = value
        writer.tick(line)
    writer.event("request", Reset())  # no steps follow it: it begins nothing
    writer.close()
    return Run.read(folder)


def test_table_iv_of_a_recorded_run(tmp_path: Path) -> None:
    run = recorded(tmp_path / "run", task_note(LABELS, 1, surface_hash(BEHIND)))
    found = measured(run, seen)
    report = found.to_dict()
    assert (report["labels_traced"], report["of"], report["beyond_bound_mm"]) == (1, 2, 0.2)
    assert report["labels"][0]["time_s"] == pytest.approx(4.0)
    assert report["labels"][0]["line_error_mm"] == pytest.approx(0.25)
    assert report["labels"][1] == dict.fromkeys(("time_s", "angle_error_deg", "line_error_mm", "distance_mm"))
    np.testing.assert_allclose(found.way[:, 0], np.arange(-10.0, 10.01, 0.5))
    assert found.red.all()
    assert [label.to_dict() for label in found.labels] == [label.to_dict() for label in LABELS]
    score = score_lumen_run(run, wall=BEHIND)
    assert score.completed is False
    assert (score.depth_mm, score.length_mm, score.reach_mm, score.share, score.insertion_s) == (None,) * 5
    assert score.task is not None
    assert (score.task.title, score.task.completed) == ("Labels", False)
    shown = {row.name: (row.value, row.worse) for row in score.task.rows}
    assert (shown["Labels traced"], shown["Labels missed"]) == ((1.0, False), (1.0, True))
    assert shown["Time per label"][0] == pytest.approx(4.0)
    assert shown["Distance from the arrow"][0] == pytest.approx(0.25)
    assert shown["Way to a label"][0] is None
    with pytest.raises(InputError, match="no task of study II"):
        measured(Run({}, {}, np.empty((0, 20)), (), True, 0), seen)


def test_a_score_asks_lines_of_sight_in_the_cavity_of_its_task(tmp_path: Path) -> None:
    hidden = score_lumen_run(recorded(tmp_path / "organ", task_note(LABELS, 1, surface_hash(BETWEEN))), wall=BETWEEN)
    assert hidden.task is not None
    assert (hidden.task.rows[0].value, hidden.task.result) == (0.0, "0 of 2 labels traced")
    unknown = score_lumen_run(Run.read(tmp_path / "organ"), wall=BEHIND).task
    assert unknown is not None
    assert "surface is missing" in unknown.lacking
    assert {row.value for row in unknown.rows} == {None}
    assert (unknown.completed, unknown.result, any(row.worse for row in unknown.rows)) == (False, "", False)
    made = score_lumen_run(recorded(tmp_path / "made", task_note(LABELS, 1, surface_hash(cavity_case().mesh)))).task
    assert made is not None
    assert (made.lacking, made.rows[0].value) == ("", 1.0)  # the cavity that comes along, in which this label is seen
    note = task_note(LABELS, 1, "")
    before = Note(note.kind, {name: value for name, value in note.content.items() if name != "surface"})
    old = score_lumen_run(recorded(tmp_path / "old", before)).task  # it was driven without lines of sight
    assert old is not None
    assert (old.lacking, old.rows[0].value) == ("", 1.0)
