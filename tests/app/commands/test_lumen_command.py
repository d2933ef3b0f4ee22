"""`vfix lumen drive` on a made-up colon, as its user would: figures, pictures, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.cli import main
from app.commands.lumen_options import open_words, read_landmarks
from app.services import build_services
from app.settings import Settings
from vfix_engine.anatomy.lumen.colon_case import colon_case
from vfix_engine.anatomy.lumen.synthetic import synthetic_colon, synthetic_course, write_stl
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.pathway_surface import pathway_surface
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.registry import spec_of


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Every drive leaves its run in a data folder of this test's own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


@pytest.fixture(scope="module")
def colon(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a made-up colon and a landmark that six links reach."""
    folder = tmp_path_factory.mktemp("colon")
    write_stl(folder / "colon.stl", synthetic_colon())
    course = synthetic_course()
    marks = {"bend": course.curve.position(150.0).tolist(), "caecum": {"lps": course.landmarks["caecum"].tolist()}}
    (folder / "landmarks.json").write_text(json.dumps({"landmarks": marks}), encoding="utf-8")
    return folder


def told(colon: Path) -> list[str]:
    """The arguments that name the colon and its ends; the end begins with a minus."""
    landmarks = synthetic_course().landmarks
    start, end = (",".join(f"{v:.3f}" for v in landmarks[name]) for name in ("anus", "caecum"))
    assert end.startswith("-")
    return ["lumen", "drive", str(colon / "colon.stl"), "--start", start, "--end", end]


def test_a_snake_is_driven_and_every_landmark_has_its_pictures(
    colon: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = ["--pictures", str(tmp_path / "seen"), "--pathway", str(tmp_path / "held_to.ply")]
    status = main([*told(colon), "--links", "6", *kept, "--json"])
    printed = capsys.readouterr()
    report = json.loads(printed.out)
    assert status == 0
    assert report["links"] == 6
    assert report["inserted_mm"] == pytest.approx(6 * 28.0)
    assert 580.0 < report["path_mm"] < 620.0
    assert report["reached"] is report["within_bounds"] is True
    bound = report["bound_mm"]
    assert 0.0 <= report["deviation_mm"]["mean"] <= report["deviation_mm"]["max"] <= max(bound.values())
    assert isinstance(report["joint_limit_hits"], int)
    assert 0.0 < report["query_us"] < report["step_us"]
    assert report["landmarks_from"] == "landmarks.json"
    bend, caecum = report["landmarks"]
    assert bend["name"] == "bend"
    assert bend["reached"] is bend["looked"] is True
    assert bend["s_mm"] == pytest.approx(150.0, abs=12.0)
    assert caecum["reached"] is False
    assert "reach" in caecum["note"]
    assert report["notice"] == "Not for clinical use."
    assert [Path(file).name for file in report["pictures"]] == ["01_bend.png", "01_bend_looking.png"]
    arrived, looking = (cv2.imread(file) for file in report["pictures"])
    assert arrived.shape == looking.shape
    assert arrived.shape[1] >= 1500
    assert np.count_nonzero((arrived != looking).any(axis=2)) > 5000  # the robot is bent in one of them
    assert "arrived bend" in printed.err
    assert f"vfix: {report['behind_wall']['words']}" in printed.err
    assert "LPS and mm are assumed" in report["surface_assumed"]
    assert report["surface_assumed"] in report["warnings"]
    assert "warning: the surface's file does not name" in printed.err
    assert report["behind_wall"]["mm"] < 8.0
    held_to, read = read_mesh(tmp_path / "held_to.ply")
    assert (read.name, read.assumed, report["pathway"]) == ("LPS", False, str(tmp_path / "held_to.ply"))
    assert len(held_to.faces) > 1000


@pytest.mark.parametrize("arm", ["manual", "guided"])
def test_a_preset_drives_in_an_arm_without_certificate_and_says_so(
    arm: str, colon: Path, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    quick = ["--links", "6", "--waypoint", "4", "--operator", "adversarial", "--landmarks", "none"]
    main([*told(colon), "--preset", "kwok2013", "--arm", arm, *quick, "--json"])
    report = json.loads(capsys.readouterr().out)
    assert (report["arm"], report["certified"], report["preset"]) == (arm, False, "kwok2013")
    assert report["printed"]["k of the last link in N/mm"] == 0.45
    assert "f_h,max" in report["assumed"]
    assert (report["links"], report["settings"]["bends"]) == (6, 4)
    assert report["inserted_mm"] > 0.0
    assert report["beyond_bound_link_steps"] > 0
    assert not any("its bound is" in reason for reason in report["held_by"])
    services = build_services(Settings(home=home, port=0))
    try:
        with services.runs.laid_out(report["run"]) as folder:
            run = Run.read(folder)
        assert run.manifest["spec"]["drive"]["arm"] == arm
        again = replay(run, spec_of(run), keep_states=False)
        assert again.same, (again.first_difference, again.largest_difference)
    finally:
        services.close()


@pytest.mark.parametrize("operator", ["scripted", "adversarial"])
def test_a_drive_leaves_a_run_that_is_driven_again(
    operator: str, colon: Path, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In tissue that moves, with a hand that means harm too: every row comes again, bit by bit."""
    coarse = ["--links", "5", "--waypoint", "4", "--breathing", "4", "--operator", operator, "--seed", "5"]
    main([*told(colon), *coarse, "--json"])
    report = json.loads(capsys.readouterr().out)
    services = build_services(Settings(home=home, port=0))
    try:
        stored = services.runs.get(report["run"])
        assert (stored.world, stored.whole, stored.origin) == ("snake drive", True, "command line")
        assert [one.id for one in services.runs.list()] == [stored.id]
        with services.runs.laid_out(stored.id) as folder:
            run = Run.read(folder)
        assert run.manifest["seed"] == (5 if operator == "adversarial" else None)
        again = replay(run, spec_of(run), keep_states=False)
        assert again.same, (again.first_difference, again.largest_difference)
        assert run.column("tip_s")[-1] == report["inserted_mm"]
        assert len(again.states) == 1
        services.runs.delete(stored.id)
        assert services.runs.list() == ()
    finally:
        services.close()


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        (["--start", "900,0,0"], "mm from the lumen"),
        (["--links", "100000"], "links"),
        (["--bound", "nan"], "bound_mm"),
        (["--radius", "40"], "radius"),
        (["--contours", "1"], "contours"),
        (["--quantile", "2"], "quantile"),
        (["--landmarks", "/no/such.json"], "such.json cannot be read"),
        (["--waypoint", "0"], "waypoint_mm"),
        (["--breathing", "-3"], "breathing"),
        (["--breathing", "1e9"], "breathing"),
        (["--peristalsis", "1"], "peristalsis"),
        (["--interpolated", "0"], "interpolated"),
        (["--contours", "100000"], "contours"),
        (["--waypoint", "1e-9"], "waypoint_mm"),
        (["--pathway", "held_to.stl"], ".ply"),
    ],
)
def test_what_cannot_be_done_is_said(
    colon: Path, changes: list[str], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = told(colon)
    if changes[0] == "--start":
        arguments[4] = changes[1]
    else:
        arguments += changes
    status = main([*arguments, "--json"])
    printed = capsys.readouterr()
    assert status == 2
    assert word in json.loads(printed.out)["error"]["message"]
    assert "Traceback" not in printed.err


def test_a_lumen_narrower_than_the_robot_is_refused_unless_it_is_wanted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """HAZ-39: status 2 before anything moves, with the place, both radii and the nearer end; `--anyway` goes on."""
    at = np.linspace(0.0, 160.0, 33)
    radius = np.interp(at, [0.0, 110.0, 120.0], [12.0, 12.0, 4.0])
    tube = Pathway(np.column_stack([np.zeros((33, 2)), at]), radius, 33)
    write_stl(tmp_path / "tube.stl", pathway_surface(tube))
    (tmp_path / "marks.json").write_text('{"landmarks": {"elsewhere": [900, 0, 0]}}', encoding="utf-8")
    tube_of = ["lumen", "drive", str(tmp_path / "tube.stl"), "--start", "0,0,10", "--links", "4", "--json"]
    quick = ["--landmarks", str(tmp_path / "marks.json"), "--contours", "12", "--interpolated", "45"]
    asked = [*tube_of, *quick, "--end", "0,0,150"]
    assert main(asked) == 2
    said = json.loads(capsys.readouterr().out)["error"]["message"]
    for words in ("narrower than the robot", "in LPS mm", "the robot's 6 mm", "the tip could go", "end at"):
        assert words in said
    main([*asked, "--anyway"])
    report = json.loads(capsys.readouterr().out)
    assert report["narrowest"]["first"]["radius_mm"] < 6.0
    assert any("wider than the pathway" in words for words in report["warnings"])
    nearer = said.partition("end at ")[2].partition(", ")[0]
    assert main([*tube_of, *quick, "--end", nearer, "--links", "2"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["narrowest"]["first"] is None
    assert report["within_bounds"] is report["reached"] is True
    assert report["behind_wall"]["per_link_mm"] == [None, None] or report["behind_wall"]["mm"] < 6.0


def test_a_surface_that_is_not_there_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lumen", "drive", str(tmp_path / "gone.stl"), "--start", "0,0,0", "--end", "1,0,0"]) == 2
    assert "gone.stl" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["1,2", "a,b,c", "1,2,nan", ""])
def test_a_place_is_three_numbers(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["lumen", "drive", "x.stl", "--start", text, "--end", "0,0,0"])
    assert "x,y,z" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["0", "-3", "many", "²"])
def test_links_are_counted_or_auto(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["lumen", "drive", "x.stl", "--start", "0,0,0", "--end", "0,0,1", f"--links={text}"])
    assert "auto" in capsys.readouterr().err


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"landmarks": []}', '{"landmarks": {"a": [1, 2]}}', '{"landmarks": {"a": [1, 2, NaN]}}',
     '{"landmarks": {"a": [1, 2, true]}}', '{"landmarks": {"a": {"lps": "1,2,3"}}}', "[" * 100_000],
)  # fmt: skip
def test_landmarks_that_are_none_are_refused(content: str, tmp_path: Path) -> None:
    file = tmp_path / "landmarks.json"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=r"landmarks\.json"):
        read_landmarks(file)


def test_two_files_of_landmarks_are_asked_about(colon: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = colon / "other_info.json"
    other.write_text('{"landmarks": {}}', encoding="utf-8")
    try:
        assert main(told(colon)) == 2
        assert "landmarks.json, other_info.json" in capsys.readouterr().err
    finally:
        other.unlink()


def test_an_open_surface_is_told() -> None:
    mesh = colon_case().mesh
    assert open_words(mesh) == ""
    assert "open" in open_words(TriangleMesh(mesh.vertices, mesh.faces[1:]))
