"""REST: the voxels of a CT as they are, with their grid."""

import numpy as np
import pytest
from rest_client import CASE, Client

from app.api.volumes import pieces
from app.cases.model import HEAD_PHANTOM
from app.services import Services
from vfix_engine.files.volume import volume_of


@pytest.mark.parametrize("name", ["head", "nose"])
def test_voxels_and_grid_make_the_volume_again(client: Client, phantom_services: Services, name: str) -> None:
    told = client.get(f"{CASE}/volume", params={"volume": name}).json()
    answer = client.get(told["voxels"])
    assert (answer.status_code, answer.headers["etag"]) == (200, f'"{told["revision"]}"')
    assert "content-encoding" not in answer.headers
    assert "no-store" in answer.headers["cache-control"], "a head is not left in the browser's cache"
    hu = np.frombuffer(answer.content, "<i2").reshape(told["shape"][::-1])
    again = volume_of(hu, np.array(told["transform_index_to_lps"]))
    stored = phantom_services.cases.volume(phantom_services.cases.get(HEAD_PHANTOM), name)
    assert stored is not None
    assert np.array_equal(again.hu, stored.hu)
    assert np.array(told["origin_mm"]) == pytest.approx(stored.origin)
    assert np.array(told["direction"]) == pytest.approx(stored.direction)
    assert told["revision"] == stored.content_hash


def test_voxels_that_are_there_already_are_not_sent_again(client: Client) -> None:
    etag = client.get(f"{CASE}/volume/voxels", params={"volume": "nose"}).headers["etag"]
    again = client.get(f"{CASE}/volume/voxels", params={"volume": "nose"}, headers={"If-None-Match": etag})
    assert (again.status_code, again.content) == (304, b"")
    other = client.get(f"{CASE}/volume/voxels", params={"volume": "head"}, headers={"If-None-Match": etag})
    assert other.status_code == 200
    assert client.get(f"{CASE}/volume/voxels", params={"volume": "brain"}).status_code == 404


def test_pieces_are_bounded_and_little_endian() -> None:
    hu = np.arange(7 * 600 * 500, dtype=">i2").astype(np.int16).reshape(7, 600, 500)
    sent = list(pieces(hu))
    assert max(map(len, sent)) <= 2 << 20
    assert np.array_equal(np.frombuffer(b"".join(sent), "<i2"), hu.ravel())
