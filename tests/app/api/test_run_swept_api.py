"""REST: what a stored run has swept, made once as a job of the run alone, and gone with it."""

from __future__ import annotations

import tarfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rest_client import Client, opened_client

from app.drives.swept_file import HEADER
from app.drives.swept_runs import FILE
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.runtime.run import Run
from vfix_engine.study.series import series_of
from vfix_engine.study.swept import SweptPoses, near_passes, swept_volume

OLD_HOME = Path(__file__).resolve().parents[2] / "data" / "old_home" / "home.tar.xz"


@pytest.fixture
def services(tmp_path: Path) -> Iterator[Services]:
    """A home of an earlier version, which holds a run of each world."""
    with tarfile.open(OLD_HOME) as archive:
        archive.extractall(tmp_path, filter="data")
    opened = build_services(Settings(home=tmp_path / "home", port=0))
    yield opened
    opened.close()


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


def test_the_swept_volume_of_a_run_is_made_once(services: Services) -> None:
    client: Client = opened_client(services)
    runs = {run.world: run for run in services.runs.list()}
    run_id = runs["rigid"].id
    path = f"/api/v1/runs/{run_id}/swept"
    assert client.get(path).status_code == 404
    job = client.post(path).json()
    assert (job["kind"], job["case_id"]) == ("swept", runs["rigid"].case_id)
    assert services.jobs.wait(job["id"]).state == "done"
    answer = client.get(path)
    assert answer.headers["x-notice"] == "Not for clinical use"

    with services.runs.laid_out(run_id) as folder:
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
    stored = services.store.derived.path(key, FILE)
    assert stored is not None
    made = stored.stat().st_mtime_ns
    assert services.jobs.wait(client.post(path).json()["id"]).state == "done"
    assert stored.stat().st_mtime_ns == made, "it was there"
    stored.write_bytes(b"VFXW, cut off")
    assert client.get(path).status_code == 404
    assert services.jobs.wait(client.post(path).json()["id"]).state == "done"
    assert client.get(path).content == answer.content
    assert client.delete(f"/api/v1/runs/{run_id}").status_code == 204
    services.sweep()
    assert services.store.derived.path(key, FILE) is None
    for method in (client.post, client.get):
        assert method(path).status_code == 404
        refused = method(f"/api/v1/runs/{runs['snake'].id}/swept")
        assert (refused.status_code, "no rigid tool" in refused.json()["error"]["message"]) == (422, True)
    client.close()


def test_a_data_folder_that_is_only_read_keeps_it_in_memory(
    services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = next(run for run in services.runs.list() if run.world == "rigid")
    monkeypatch.setattr(type(services.store), "writable", property(lambda store: False))
    monkeypatch.setattr(services.store.scratch, "new_place", services.store.exports.new_place)
    assert services.jobs.wait(services.swept_runs.start(run.id).id).state == "done"
    assert services.swept_runs.known(run.id) is not None
    assert services.store.derived.path(run.files["ticks.f64"].sha256, FILE) is None
