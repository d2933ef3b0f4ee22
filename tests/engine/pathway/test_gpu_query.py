"""The GPU's kernel, run thread by thread by numba's simulator: it finds what the processor's query finds.

The simulator is chosen before numba is loaded, so everything is asked in a process of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vfix_engine.errors import InputError
from vfix_engine.pathway.query import gpu
from vfix_engine.robots.snake_surface import LinkVertices

ROOT = Path(gpu.__file__).parents[2]

ASKING = """
import json
import numpy as np
from vfix_engine.errors import InputError
from vfix_engine.pathway.query import gpu
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.query.query import Query, deviation_of_points
from vfix_engine.robots.snake_surface import LinkVertices
from lumen_shapes import arc, helix, straight

random = np.random.default_rng(5)
start = np.array([0, 11, 18, 43])
vertices = LinkVertices(random.normal(0.0, 6.0, (43, 3)), start)
link = np.repeat(np.arange(3), np.diff(start))


def poses(count, spread):
    frames = np.tile(np.eye(4)[:3], (count, 3, 1, 1))
    for k in range(count):
        for l in range(3):
            frames[k, l, :, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0]
            frames[k, l, :, 3] = [0.0, 0.0, 20.0 + 25.0 * l] + random.normal(0.0, spread, 3)
    return frames


def told(found, packed, frames, windows):
    # How far from the processor's answers, whether vertex and segment have what is told, and how many are outside.
    windows = np.broadcast_to(windows, (3, 2))
    apart, named = 0.0, True
    for k, pose in enumerate(frames):
        places = np.einsum("vij,vj->vi", pose[link, :, :3], vertices.points) + pose[link, :, 3]
        for l in range(3):
            own = slice(start[l], start[l + 1])
            depth = found.depth[k, l]
            apart = max(apart, abs(depth - deviation_of_points(places[own], packed, *windows[l])[0].max()))
            vertex, segment = found.vertex[k, l], found.segment[k, l]
            at = deviation_of_points(places[[vertex]], packed, segment, segment + 1)[0][0]
            inside = windows[l][0] <= segment < windows[l][1] and start[l] <= vertex < start[l + 1]
            named &= bool(inside and abs(at - depth) < 1e-9)
    return {"apart": float(apart), "named": named, "outside": int((found.depth > 0.0).sum()), "all": found.depth.size}


out = {"available": gpu.available()}
query = gpu.GpuQuery(vertices, threads=16)
bent = arc(contours=6).packed()
three = poses(3, 5.0)
each = np.array([[0, 3], [2, 5], [4, 7]])
out["windows"] = told(query.deviations(bent, three, each), bent, three, each)
out["fewer_poses"] = told(query.deviations(bent, three[1:2], (1, 4)), bent, three[1:2], (1, 4))
wider = PackedPathway(bent.rows.copy(), 1.5 * bent.polar)
out["other_radii"] = told(query.deviations(wider, three[:1], (0, 4)), wider, three[:1], (0, 4))
wider.polar[:] = bent.polar  # may be written to, so it is sent again
out["written"] = told(query.deviations(wider, three[:1], (0, 4)), bent, three[:1], (0, 4))
lobed = helix(contours=5, angles=7).packed()
shifted = poses(1, 15.0)
shifted[:, :, 0, 3] += 60.0
out["polar"] = told(query.deviations(lobed, shifted, (0, 4)), lobed, shifted, (0, 4))
long = straight(contours=36).packed()  # more segments than are staged at a time
out["long"] = told(query.deviations(long, three[:1], (0, 37)), long, three[:1], (0, 37))
places = np.einsum("vij,vj->vi", three[0, link, :, :3], vertices.points) + three[0, link, :, 3]
sent = query.deviations_of(places, bent, each)
out["sent"] = float(np.abs(sent.depth - query.deviations(bent, three[0], each).depth).max())
wide = straight(radius=80.0, contours=4).packed()
still = query.deviations(wide, three[0], (0, 5))
out["inside"] = {"depth": still.depth.tolist(), "vertex": still.vertex.tolist()}

gpu.MOST_BLOCKS = 2  # so that a thread has several vertices
few = gpu.GpuQuery(vertices, threads=4)
out["several_each"] = told(few.deviations(bent, three[:1], (1, 4)), bent, three[:1], (1, 4))
refused = []
beyond = three[0].copy()
beyond[1, 0, 3] = 1e101
for wrong in (np.full((3, 3, 4), np.nan), beyond, np.zeros((2, 3, 4))):
    for asked in (query, Query(vertices)):
        try:
            asked.deviations(bent, wrong, (0, 3))
        except InputError as error:
            refused.append(str(error))
for points in (places[:-1], np.full_like(places, np.inf)):
    try:
        query.deviations_of(points, bent, (0, 3))
    except InputError as error:
        refused.append(str(error))
out["refused"] = refused
print(json.dumps(out))
"""


def ask(program: str, **environment: str) -> str:
    paths = os.pathsep.join([str(ROOT), str(Path(__file__).parents[1])])
    environment = os.environ | {"PYTHONPATH": paths} | environment
    done = subprocess.run(
        [sys.executable, "-W", "error", "-P", "-c", program], env=environment, capture_output=True, text=True,
        timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def told() -> dict[str, Any]:
    return json.loads(ask(ASKING, NUMBA_ENABLE_CUDASIM="1"))


@pytest.mark.parametrize("case", ["windows", "fewer_poses", "other_radii", "written", "polar", "long", "several_each"])
def test_it_finds_what_the_processor_finds(told: dict[str, Any], case: str) -> None:
    assert told[case]["outside"] > 0  # else it would prove nothing
    assert told[case]["apart"] < 1e-9
    assert told[case]["named"]


def test_vertices_that_are_sent_are_those_that_stay(told: dict[str, Any]) -> None:
    assert told["sent"] < 1e-9


def test_of_a_link_that_is_inside_the_first_vertex_is_named(told: dict[str, Any]) -> None:
    assert told["inside"] == {"depth": [0.0, 0.0, 0.0], "vertex": [0, 11, 18]}


def test_what_cannot_be_asked_is_refused(told: dict[str, Any]) -> None:
    *frames, shape, infinite = told["refused"]
    assert len(frames) == 6
    assert frames[::2] == frames[1::2]  # in the words of the processor's query
    assert frames[:4] == ["frames are not finite: give finite transforms"] * 4
    assert "2 links for a snake of 3" in frames[4]
    assert "(43, 3)" in shape
    assert "(43, 3)" in infinite


def test_the_simulator_is_no_gpu(told: dict[str, Any]) -> None:
    assert told["available"] is False


def test_without_a_gpu_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices = LinkVertices(np.zeros((2, 3)), np.array([0, 2]))
    if not gpu.available():
        with pytest.raises(gpu.GpuUnavailable, match="GPU"):
            gpu.GpuQuery(vertices)
    with pytest.raises(InputError, match="power of two"):
        gpu.GpuQuery(vertices, threads=48)
    with pytest.raises(InputError, match="no vertices"):
        gpu.GpuQuery(LinkVertices(np.zeros((2, 3)), np.array([0, 2, 2])))


def test_it_costs_nothing_until_it_is_used() -> None:
    loaded = ask("import sys; import vfix_engine.pathway.query.gpu; print('numba.cuda' in sys.modules)")
    assert loaded.strip() == "False"
