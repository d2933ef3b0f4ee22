"""`vfix lumen viewable` on a made-up colon, as its user would."""

import json
from pathlib import Path

import pytest

from app.cli import main
from vfix_engine.anatomy.lumen.synthetic import synthetic_colon, synthetic_course, write_stl


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The arguments that name the colon, its ends and a short robot."""
    file = tmp_path_factory.mktemp("colon") / "colon.stl"
    write_stl(file, synthetic_colon())
    landmarks = synthetic_course().landmarks
    start, end = (",".join(f"{v:.3f}" for v in landmarks[name]) for name in ("anus", "caecum"))
    short = ["--links", "6", "--every", "42"]
    return ["lumen", "viewable", str(file), "--start", start, "--end", end, *short]


def test_the_share_is_told_and_places_are_driven_to(told: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    status = main([*told, "--confirm", "3", "--json"])
    report = json.loads(capsys.readouterr().out)
    assert report["depth_mm"] == pytest.approx(6 * 28.0)
    assert 0.02 < report["share"] < 1.0
    assert len(report["along"]) == 10
    assert min(report["along"]) <= report["share"] <= max(report["along"])
    assert report["views"] > 3
    assert report["limits"] == {
        "distance_mm": 15.0, "distance_tolerance_mm": 7.0, "angle_deg": 20.0, "frame_deg": 20.0
    }  # fmt: skip
    assert report["robot"]["links"] == 6
    assert report["notice"] == "Not for clinical use."
    confirmed = report["confirmed"]
    assert (confirmed["of"], confirmed["beyond_bound"]) == (3, 0)
    assert confirmed["viewed"] + len(confirmed["missed"]) == 3
    assert status == (0 if confirmed["viewed"] == 3 else 1)


def test_people_are_told_in_lines_and_what_cannot_be_is_refused(
    told: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*told, "--breathing", "8", "--length", "14", "--radius", "4", "--manipulated", "4"]) == 0
    lines = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert float(lines["depth_mm"]) == pytest.approx(6 * 14.0)
    assert json.loads(lines["robot"])["length_mm"] == 14.0
    assert lines["confirmed"] == "None"
    for wrong, words in ((["--every", "0"], "between two depths"), (["--links", "0"], "links")):
        assert main([*told, *wrong]) == 2
        assert words in capsys.readouterr().err


def test_a_surface_that_cannot_be_read_is_refused(
    told: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "colon.stl"
    file.write_bytes(b"no surface")
    assert main([*told[:2], str(file), *told[3:]]) == 2
    assert "colon.stl" in capsys.readouterr().err
