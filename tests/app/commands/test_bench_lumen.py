"""`vfix bench lumen`: its keys, its peers, its sweeps and its plots, with few vertices."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from app import cli
from benchmarks import lumen, lumen_bends, lumen_controls, lumen_gpu, lumen_plots, plots
from benchmarks.lumen_peers import NumpyQuery, literal_query
from benchmarks.lumen_scene import Scene
from benchmarks.lumen_threads import ThreadedQuery
from vfix_engine.pathway.packed import pack
from vfix_engine.pathway.query.query import Query, deviation_of_points

TEXT = "{http://www.w3.org/2000/svg}text"


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.made()


def test_it_measures_compares_and_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lumen, "COUNTS", (100, 400))
    monkeypatch.setattr(lumen, "SHARES", (0.5, 1.0))
    monkeypatch.setattr(lumen_gpu, "measure", lambda *asked: None)  # also where there is a GPU
    for figure in ("figure_7c", "figure_8"):  # their own test looks at what is in them
        monkeypatch.setattr(lumen_bends, figure, lambda *asked: plots.empty_figure(1.0, 1.0, 0.0, "drawn", ""))
    folder = tmp_path / "plots"
    options = ["--vertices", "400", "--rounds", "3", "--threads", "1", "--plots", str(folder), "--json"]
    assert cli.main(["bench", "lumen", *options]) == 0
    result = json.loads(capsys.readouterr().out)
    assert set(result["us"]) == {"400_inside", "400_mixed", "500"}
    assert min(result["us"].values()) > 0.0
    assert {"vs_literal", "vs_numpy"} <= set(result["ratios"])
    assert result["max_abs_diff"] <= 1e-9
    assert result["correct"] is True
    assert result["gpu"] is None
    assert result["bends"] is None
    assert result["controls"] is None
    assert result["outside_percent"]["inside"] == 0.0
    assert result["outside_percent"]["narrow"] > 90.0
    assert min(result["ratios"].values()) == min(min(each.values()) for each in result["ratios_by_scene"].values())
    assert abs(result["outside_percent"]["mixed"] - 20.0) < 3.0  # 400 vertices do not share out more finely
    assert [row["vertices"] for row in result["vertices_sweep"]] == [100, 400]
    assert [row["inside_percent"] for row in result["inside_sweep"]] == [50.0, 100.0]
    assert result["inside_sweep"][1]["outside_percent"] == 0.0
    assert result["meets"]["500_within_30_us"] is (result["us"]["500"] <= 30.0)
    assert result["meets"]["agreement_within_1e-9_mm"] is True
    assert [result["meets"][f"{scene}_within_1_ms"] for scene in ("inside", "mixed")] == [None, None]
    names = ("lumen_vertices", "lumen_inside", "lumen_cost", "lumen_bends")
    assert result["plots"] == [str(folder / f"{name}.svg") for name in names]
    first, second, *bends = ({text.text for text in ElementTree.parse(one).iter(TEXT)} for one in result["plots"])
    assert bends == [{"drawn"}, {"drawn"}]
    for words in (first, second):
        assert {"vfix, one core", "as printed, compiled", "numpy", "1 ms", "time of one query"} <= words
    assert "number of vertices" in first
    assert "vertices inside, %" in second


def test_a_run_says_which_targets_it_meets() -> None:
    ours, small = {"inside": 1000.0, "mixed": 1000.0, "narrow": 5000.0}, 30.0
    least = {"vs_literal": 9.0, "vs_numpy": 150.0, "every_vertex_vs_literal": 1.0, "every_vertex_vs_numpy": 1.0}
    met = lumen.meets(ours, small, least, 14_800, True)
    assert met == dict.fromkeys(met, True)
    assert len(met) == 6
    for change, name in (
        ({"ours": ours | {"inside": 1001.0}}, "inside_within_1_ms"),
        ({"ours": ours | {"mixed": 1001.0}}, "mixed_within_1_ms"),
        ({"small": 30.1}, "500_within_30_us"),
        ({"least": least | {"vs_literal": 8.9}}, "9_times_vs_literal"),
        ({"least": least | {"vs_numpy": 149.0}}, "150_times_vs_numpy"),
        ({"correct": False}, "agreement_within_1e-9_mm"),
    ):
        given = {"ours": ours, "small": small, "least": least, "count": 14_800, "correct": True} | change
        assert lumen.meets(**given) == met | {name: False}
    assert list(lumen.meets(ours, small, least, 400, True).values()) == [None] * 4 + [True] * 2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--vertices", "4"], "5 to 1,000,000 vertices"),
        (["--rounds", "2"], "3 rounds"),
        (["--threads", "0"], "--threads 0"),
        (["--no-sweeps", "--plots", "x"], "--no-sweeps leaves out"),
        (["--gpu"], "no GPU"),
    ],
)
def test_it_refuses(
    options: list[str], words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(lumen_gpu.gpu, "available", lambda: False)
    assert cli.main(["bench", "lumen", *options]) == 2
    assert words in capsys.readouterr().err


def test_without_matplotlib_plots_are_refused_before_anything_is_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert cli.main(["bench", "lumen", "--plots", str(tmp_path / "plots")]) == 2
    assert "--plots draws with matplotlib, which is not installed: pip install 'vfix[test]'" in capsys.readouterr().err


def test_the_mixed_scene_has_a_fifth_outside(scene: Scene) -> None:
    share = scene.share_outside(Query(scene.vertices(14_800)), scene.poses(scene.shift_for(0.2), 15))
    assert abs(share - 0.2) <= 0.01


def test_the_peers_find_what_the_engine_finds_on_tilted_cones(scene: Scene) -> None:
    """Contours that lean by up to 40° and change their radius, points inside, outside, beyond the ends, on the axis."""
    random = np.random.default_rng(3)
    centre = np.cumsum(random.uniform(5.0, 15.0, (7, 1)) * [0.1, -0.2, 1.0], axis=0)
    tangent = np.tile([0.0, 0.0, 1.0], (7, 1)) + random.uniform(-0.4, 0.4, (7, 3))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    first = np.cross(tangent, [0.3, 1.0, 0.1])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    radius = random.uniform(4.0, 25.0, (7, 1))
    packed = pack(centre, tangent, first, radius)
    points = random.uniform(-40.0, 40.0, (600, 3)) + random.choice(centre, 600)
    points[:60] = centre[0] + np.linspace(0.05, 0.95, 60)[:, None] * (centre[1] - centre[0])
    start, still = np.array([0, 600]), np.eye(4)[None, :3]
    gap = np.empty(600)
    depth = literal_query(points, start, still, packed.rows, radius[:, 0].copy(), 0, 6, gap)
    wanted, _ = deviation_of_points(points, packed, 0, 6)
    assert 100 < np.count_nonzero(wanted) < 590
    assert np.abs(gap - wanted).max() < 1e-9
    assert depth[0] == gap.max()
    by_arrays = NumpyQuery(points, start, packed.rows, radius[:, 0]).deviations(still)
    assert np.abs(by_arrays[1] - wanted).max() < 1e-9
    assert by_arrays[0][0] == by_arrays[1].max()


def test_threads_find_the_same(scene: Scene) -> None:
    vertices = scene.vertices(300)
    pose = scene.poses(8.0, 1)[0]
    asked = ThreadedQuery(vertices, scene.packed, scene.window, 2)
    found = asked.deviations(pose)
    asked.close()
    assert found.min() > 0.0
    assert np.array_equal(found, Query(vertices).deviations(scene.packed, pose, scene.window).depth)


def test_bends_are_searched_within_a_hundred_evaluations(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison of the controls has a test of its own, beside them."""
    monkeypatch.setattr(lumen_controls, "compare_controls", lambda attack_steps: {"steps": attack_steps})
    told = lumen_controls.measure(scene, 1, 7)
    assert told["controls"] == {"steps": 7}
    for count in ("4", "8"):
        assert told["bends"][count]["ms"] > 0.0
        assert told["bends"][count]["evaluations_most"] <= 100
        assert told["bends"][count]["feasible"]


SIMULATED = """
import functools, json
from benchmarks import lumen_gpu
from benchmarks.lumen_scene import Scene
lumen_gpu.COUNTS = lumen_gpu.NAMED = (40,)
lumen_gpu.POSES = 1
lumen_gpu.gpu.available = lambda: True
lumen_gpu.gpu.GpuQuery = functools.partial(lumen_gpu.gpu.GpuQuery, threads=8)
print(json.dumps(lumen_gpu.measure(Scene.made(), 8.0, 1), allow_nan=False))
"""


def test_a_gpu_is_measured_and_held_against_the_loops() -> None:
    """With numba's simulator in its place, which is chosen before numba is loaded."""
    environment = os.environ | {"NUMBA_ENABLE_CUDASIM": "1", "PYTHONPATH": str(Path(lumen.__file__).parents[1])}
    command = [sys.executable, "-W", "error", "-P", "-c", SIMULATED]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert set(told) == {"name", "us", "khz", "max_abs_diff", "vertices_sweep"}
    assert told["name"] == "numba's simulator"
    assert told["max_abs_diff"] < 1e-9
    assert told["khz"]["40"] == pytest.approx(1e3 / told["us"]["40"])
    assert set(told["vertices_sweep"][0]) == {"vertices", "us", "vertices_sent_us", "max_abs_diff"}


def test_names_lie_apart_and_near_to_their_lines() -> None:
    assert plots.spread([10.0, 50.0], 17.0) == [10.0, 50.0]
    assert plots.spread([10.0, 12.0, 14.0], 10.0) == pytest.approx([2.0, 12.0, 22.0])
    places = plots.spread([0.0, 1.0, 30.0, 35.0, 36.0], 10.0)
    assert np.diff(places).min() >= 10.0 - 1e-9
    assert np.abs(np.array(places) - [0.0, 1.0, 30.0, 35.0, 36.0]).max() < 10.0


def test_a_plot_has_what_was_measured_and_leaves_out_what_was_not() -> None:
    def row(vertices: int, us: float | None) -> dict[str, float | None]:
        names = ("ours_us", "2_threads_us", "every_vertex_us", "literal_us", "numpy_us")
        return dict.fromkeys(names, us) | {"vertices": vertices, "inside_percent": 50.0, "outside_percent": 20.0}

    rows = [row(500, 10.0), row(1000, None), row(2000, 40.0)]
    gpu = {"vertices_sweep": [{"vertices": 500, "us": 30.0}]}
    figures = lumen_plots.sweeps_drawn({"vertices_sweep": rows, "inside_sweep": rows}, 1000, gpu)
    lines = {line.get_label(): line for line in figures["lumen_vertices.svg"].axes[0].get_lines()}
    np.testing.assert_allclose(lines["vfix, one core"].get_xydata(), [[500.0, 10e-6], [2000.0, 40e-6]])
    np.testing.assert_allclose(lines["vfix, GPU"].get_xydata(), [[500.0, 30e-6]])
    words = {text.get_text() for text in figures["lumen_vertices.svg"].axes[0].texts}
    assert {"vfix, one core", "vfix, 2 threads", "vfix, GPU"} <= words
    assert "vfix, GPU" not in {text.get_text() for text in figures["lumen_inside.svg"].axes[0].texts}
