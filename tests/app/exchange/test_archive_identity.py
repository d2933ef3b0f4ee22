"""The case of an archive matches its content hash, which ties plans and registrations to an anatomy."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from session_doubles import other_case

from app.cases.model import HEAD_PHANTOM
from app.cases.service import hash_of
from app.plans.model import PlanContent
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.errors import InputError

Entries = dict[str, bytes]


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    made = build_services(Settings(home=tmp_path_factory.mktemp("identity"), port=0))
    yield made
    made.close()


def entries_of(services: Services, case_id: str) -> Entries:
    target = io.BytesIO()
    services.archive_writer.write(case_id, target)
    with zipfile.ZipFile(target) as packed:
        return {name: packed.read(name) for name in packed.namelist()}


def packed(entries: Entries, path: Path) -> Path:
    found = {name: data for name, data in entries.items() if name != "SHA256SUMS"}
    sums = "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in found.items())
    with zipfile.ZipFile(path, "w") as target:
        for name, data in {**found, "SHA256SUMS": sums.encode()}.items():
            target.writestr(name, data)
    return path


def mirrored(entries: Entries) -> Entries:
    """The entries with the bone mirrored in x, under the hash of its new file wherever that is named."""
    case = json.loads(entries["case.json"])
    info = next(one for one in case["content"]["surfaces"] if one["name"] == "bone")
    old = info["source"].removeprefix("sha256:")
    with np.load(io.BytesIO(entries[f"files/{old[:2]}/{old}"])) as arrays:
        vertices, faces = arrays["vertices"] * [-1.0, 1.0, 1.0], arrays["faces"][:, ::-1]
    target = io.BytesIO()
    np.savez(target, vertices=vertices, faces=faces)
    new = hashlib.sha256(target.getvalue()).hexdigest()
    info["bounds_lps_mm"] = [vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()]
    text = json.dumps(case).replace(old, new)
    kept = {name: data for name, data in entries.items() if not name.endswith(old)}
    return {**kept, "case.json": text.encode(), f"files/{new[:2]}/{new}": target.getvalue()}


def with_hash(entries: Entries, content_hash: str) -> Entries:
    """Another content hash, in the case and its documents."""
    old = json.loads(entries["case.json"])["content_hash"]
    return {
        name: data.replace(old.encode(), content_hash.encode()) if name.endswith(".json") else data
        for name, data in entries.items()
    }


@pytest.mark.parametrize("case", ["imported", "shipped"])
def test_a_mirrored_head_does_not_pass_as_the_original(services: Services, tmp_path: Path, case: str) -> None:
    case_id = HEAD_PHANTOM if case == "shipped" else other_case(services).id
    before = [one.id for one in services.cases.list()]
    path = packed(mirrored(entries_of(services, case_id)), tmp_path / "mirrored.zip")
    with pytest.raises(InputError, match="not those that its content_hash names"):
        services.archive_reader.read(path)
    assert [one.id for one in services.cases.list()] == before


def test_another_hash_is_refused(services: Services, tmp_path: Path) -> None:
    entries = entries_of(services, other_case(services).id)
    with pytest.raises(InputError, match="not those that its content_hash names"):
        services.archive_reader.read(packed(with_hash(entries, "ab" * 32), tmp_path / "other.zip"))


def test_structures_that_were_imported_later_are_no_part_of_it(services: Services, tmp_path: Path) -> None:
    case = other_case(services)
    spare = services.cases.files.put_surface("optic", services.cases.case_surface(case.id))

    def change(content: Any, _: Any) -> Any:
        (bone,) = content.structures
        optic = type(bone)(
            "optic", "Optic nerve", "spare", "optic", spare.source, bone.provenance, 0.5, True, colour="#ffaa00"
        )
        values = {**vars(content), "surfaces": (*content.surfaces, spare), "structures": (bone, optic)}
        return type(content)(**values)

    services.cases.change_content(case.id, change)
    made = services.archive_reader.read(packed(entries_of(services, case.id), tmp_path / "case.zip"))
    assert (made.content_hash, len(made.protectable)) == (case.content_hash, 1)


@pytest.mark.parametrize("change", [lambda entries: entries, mirrored])
def test_the_head_of_another_version_gets_a_hash_of_its_own(
    services: Services, tmp_path: Path, change: Callable[[Entries], Entries]
) -> None:
    """Its assets are not here to compare; its documents go on belonging to it."""
    entries = change(with_hash(entries_of(services, HEAD_PHANTOM), "cd" * 32))
    made = services.archive_reader.read(packed(entries, tmp_path / "head.zip"))
    assert made.content_hash not in ("cd" * 32, services.cases.get(HEAD_PHANTOM).content_hash)
    assert made.content_hash == hash_of(made)
    (plan,) = services.plans.list(made.id)
    assert plan.case_hash == made.content_hash
    assert services.plans.create(made.id, "Way", PlanContent()).case_hash == made.content_hash
    services.purge.run(made.id)
