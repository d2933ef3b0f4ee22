"""`vfix rehearse --errors` and `vfix score --errors`: where the tool truly was, as their user would ask."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.cli import main
from app.commands.rehearse_errors import chain_of
from app.registration.document import FiducialPair, RegistrationContent
from app.registration.fit_report import fitted
from app.registration.simulated_error import simulated_error
from app.registration.simulated_touch import simulated_pose, simulated_touches
from tests.engine.scenes import curved_tube

SHIFT = [0.3, 0.0, 0.4]


@pytest.fixture
def tube(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The arguments that name a curved tube and a path along its middle, in a home of their own."""
    monkeypatch.setenv("VFIX_HOME", str(tmp_path / "home"))
    mesh, points = curved_tube()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(tmp_path / "tube.ply")
    rows = "".join(f"point,p{i},{x!r},{y!r},{z!r}\n" for i, (x, y, z) in enumerate(points[:2].tolist()))
    (tmp_path / "plan.csv").write_text(f"# frame=LPS\n# unit=mm\nkind,label,x,y,z\n{rows}")
    return ["--case", str(tmp_path / "tube.ply"), "--plan", str(tmp_path / "plan.csv"), "--json"]


def told(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[dict, str]:
    assert main(arguments) == 0
    said = capsys.readouterr()
    return json.loads(said.out), said.err


def test_a_drive_says_where_its_tool_truly_was_and_its_run_is_scored_alike(
    tube: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shift = tmp_path / "shift.json"
    shift.write_text(json.dumps({"schema": "vfix-errors/1", "registration": {"shift_mm": SHIFT}}))
    shifted, words = told(["rehearse", *tube, "--preset", "li2007", "--errors", str(shift)], capsys)
    assert "nearer to bone" not in words
    assert shifted["error_chain"]["registration"]["shift_mm"] == SHIFT
    assert 0.1 < shifted["true_error_mm"]["mean"] <= 0.5 + shifted["tip_error_mm"]["max"]
    assert shifted["truth"]["largest_difference_mm"] == pytest.approx(0.5)
    assert shifted["truth"]["min_true_clearance_mm"] != shifted["min_bone_clearance_mm"]
    (score,) = told(["score", shifted["run"], "--errors", str(shift), "--json"], capsys)[0]["runs"]
    assert score["true_error_mm"] == score["path_error_mm"]["true_frame"]
    assert score["true_error_mm"]["mean"] == pytest.approx(shifted["true_error_mm"]["mean"], abs=0.01)
    assert score["truth"] == pytest.approx(shifted["truth"])
    deep = tmp_path / "deep.json"
    deep.write_text(json.dumps({"schema": "vfix-errors/1", "registration": {"shift_mm": [5.5, 0.0, 0.0]}}))
    drowned, words = told(["rehearse", *tube, "--preset", "li2007", "--errors", str(deep)], capsys)
    assert drowned["tip_error_mm"] == shifted["tip_error_mm"], "the drive is the same"
    assert drowned["truth"]["steps_below_margin"] >= drowned["truth"]["steps_in_bone"] > 0
    assert "nearer to bone than the margin" in words
    deep.write_text("{}")
    assert main(["rehearse", *tube, "--errors", str(deep)]) == 2
    assert "no error chain" in capsys.readouterr().out
    (score,) = told(["score", shifted["run"], "--json"], capsys)[0]["runs"]
    assert score["true_error_mm"] == score["path_error_mm"]["robot_frame"]
    assert not any(score["error_chain"].values())


def test_a_free_hand_has_the_errors_of_its_navigation_alone(
    tube: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    report, words = told(["rehearse", *tube, "--mode", "freehand", "--steady", "--errors", "papers"], capsys)
    assert "a free hand has no robot" in words
    assert "compliance.mm_per_n" in report["error_sources"]
    off = np.linalg.norm(report["error_chain"]["registration"]["shift_mm"])
    assert report["truth"]["largest_difference_mm"] == pytest.approx(off, rel=0.5)


def test_a_registration_by_the_simulated_pointer_has_its_own_error() -> None:
    places = np.array([[0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [0.0, 80.0, 0.0], [0.0, 0.0, 80.0]])
    measured = simulated_touches("case", places, 0.8, seed=5)
    pairs = tuple(
        FiducialPair(id=str(i), label=str(i), in_image=tuple(a), measured=tuple(b), measured_from="simulated")
        for i, (a, b) in enumerate(zip(places.tolist(), measured.tolist(), strict=True))
    )
    fit = fitted(pairs)
    content = RegistrationContent(transform=tuple(fit.transform.ravel().tolist()), pairs=pairs, made_from="pairs")
    motion = simulated_error(content, "case")
    assert motion is not None
    path = np.array([[10.0, 20.0, 30.0], [20.0, 20.0, 30.0]])
    chain = chain_of("papers", 0, path, content, "case")
    assert chain.registration is not None
    truth = simulated_pose("case")
    at = path.mean(axis=0)
    there = fit.transform[:3, :3] @ at + fit.transform[:3, 3]  # where the robot goes for this place of the image
    goes = np.linalg.solve(truth, np.append(there, 1.0))[:3]  # and which place of the head is truly there
    np.testing.assert_allclose(chain.registration.shift_mm, goes - at, atol=1e-9)
    assert 0.01 < np.linalg.norm(chain.registration.shift_mm) < 3.0
    assert simulated_error(RegistrationContent(), "case") is None
    other = chain_of("papers", 0, path, RegistrationContent(pairs=pairs), "case")
    assert other.registration != chain.registration, "drawn"
    assert chain_of("none", 0, path, content, "case").empty
