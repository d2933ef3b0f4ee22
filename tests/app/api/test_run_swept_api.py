"""REST: what a stored run has swept, made once as a job of the run alone, and gone with it."""

from __future__ import annotations

import numpy as np
import pytest
from rest_client import Client, opened_client

from app.drives.swept_file import HEADER
from app.drives.swept_runs import FILE
from app.services import Services
from vfix_engine.runtime.run import Run
from vfix_engine.study.series import series_of
from vfix_engine.study.swept import SweptPoses, near_passes, swept_volume


def parts_of(data: bytes) -> tuple[dict[str, float], list[np.ndarray]]:
    """Figures and arrays of a file, read by its description."""
    header = np.frombuffer(data[: HEADER.itemsize], HEADER, 1)[0]
    counts, at, arrays = header["counts"][1:], HEADER.itemsize, []
    kinds = ((3, "<f4"), (3, "<u4"), (3, "<f4"), (3, "<u4"), (1, "<f4"))
    for count, (width, kind) in zip([*counts, counts[2]], kinds, strict=True):
        size = 4 * width * int(count)
        arrays.append(np.frombuffer(data[at : at + size], kind).reshape(-1, width))
        at += size
    assert at == len(data)
    return dict(zip(("reach", "least", "volume"), header["figures"].tolist(), strict=True)), arrays


def test_the_swept_volume_of_a_run_is_made_once(old_home: Services) -> None:
    client: Client = opened_client(old_home)
    runs = {run.world: run for run in old_home.runs.list()}
    run_id = runs["rigid"].id
    path = f"/api/v1/runs/{run_id}/swept"
    assert client.get(path).status_code == 404
    job = client.post(path).json()
    assert (job["kind"], job["case_id"]) == ("swept", runs["rigid"].case_id)
    assert old_home.jobs.wait(job["id"]).state == "done"
    answer = client.get(path)
    assert answer.headers["x-notice"] == "Not for clinical use"

    with old_home.runs.laid_out(run_id) as folder:
        run = Run.read(folder)
    poses = SweptPoses.of(series_of(run))
    volume, passes = swept_volume(poses), near_passes(run.arrays["vertices"], run.arrays["faces"], poses)
    figures, (vertices, faces, near, corners, least) = parts_of(answer.content)
    assert figures["volume"] == pytest.approx(volume.volume_mm3, rel=1e-6)
    assert figures["reach"] == 5.0
    assert figures["least"] == pytest.approx(passes.least_mm.min(initial=5.0), abs=1e-5)
    np.testing.assert_allclose(vertices, volume.vertices, atol=1e-4)
    np.testing.assert_array_equal(faces, volume.faces)
    np.testing.assert_array_equal(near, passes.vertices.astype("<f4"))
    np.testing.assert_array_equal(corners, passes.faces)
    np.testing.assert_allclose(least[:, 0], passes.least_mm, atol=1e-5)

    key = runs["rigid"].files["ticks.f64"].sha256
    stored = old_home.store.derived.path(key, FILE)
    assert stored is not None
    made = stored.stat().st_mtime_ns
    assert old_home.jobs.wait(client.post(path).json()["id"]).state == "done"
    assert stored.stat().st_mtime_ns == made, "it was there"
    stored.write_bytes(b"VFXW, cut off")
    assert client.get(path).status_code == 404
    assert old_home.jobs.wait(client.post(path).json()["id"]).state == "done"
    assert client.get(path).content == answer.content
    assert client.delete(f"/api/v1/runs/{run_id}").status_code == 204
    old_home.sweep()
    assert old_home.store.derived.path(key, FILE) is None
    for method in (client.post, client.get):
        assert method(path).status_code == 404
        refused = method(f"/api/v1/runs/{runs['snake'].id}/swept")
        assert (refused.status_code, "no rigid tool" in refused.json()["error"]["message"]) == (422, True)
    client.close()


def test_a_data_folder_that_is_only_read_keeps_it_in_memory(
    old_home: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = next(run for run in old_home.runs.list() if run.world == "rigid")
    monkeypatch.setattr(type(old_home.store), "writable", property(lambda store: False))
    monkeypatch.setattr(old_home.store.scratch, "new_place", old_home.store.exports.new_place)
    assert old_home.jobs.wait(old_home.swept_runs.start(run.id).id).state == "done"
    assert old_home.swept_runs.known(run.id) is not None
    assert old_home.store.derived.path(run.files["ticks.f64"].sha256, FILE) is None
