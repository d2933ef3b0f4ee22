"""The case that travels with vfix: the synthetic head, and the sample plan in it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace

import numpy as np

from app.cases.files import ASSET, PHANTOM_CT, CaseFiles, surface_info, volume_info
from app.cases.model import (
    HEAD_PHANTOM,
    Case,
    CaseBead,
    CaseContent,
    CaseFrame,
    anatomy_structure,
    own_surfaces,
    to_triple,
)
from app.cases.service import CaseService
from app.cases.structures import BONE, Provenance, is_closed
from app.kit.errors import NotFound
from app.plans.model import PlanFile, content_from_json
from app.plans.service import PlanService
from app.store import Store
from app.store.errors import StoreDamaged
from app.store.models import DocumentRow
from vfix_engine.anatomy.phantom import BONE_REPORT, load_head_ct, load_nose_ct
from vfix_engine.files.volume import Volume
from vfix_engine.resources import assets_dir

SAMPLE_PLAN = "head-phantom-sample"
_NAME = "Head phantom"
_FOLDER = "head_phantom"
_SURFACES = {
    BONE: "bone_nose.ply",
    "skull": "skull_display.ply",
    "skull_half": "skull_half_display.ply",
    "skin": "skin_display.ply",
}
_VOLUMES = ("ct_head.nrrd", "ct_nose.nrrd")


def ensure_head_phantom(store: Store, cases: CaseService, plans: PlanService) -> None:
    """Make the embedded case and its sample plan where they are missing; follow the assets where they are newer.

    What the user did to them stays: a new name, a deletion, edits of the plan.
    """
    content_hash = shipped_hash()
    try:
        known = cases.get(HEAD_PHANTOM)
    except (NotFound, StoreDamaged):
        known = None
    if known is None or known.content_hash != content_hash or known.anatomy.has_inside is None:
        content = _with_imported(_content(CaseFiles(store.files)), known)
        cases.put(HEAD_PHANTOM, _NAME, content, content_hash)
    with store.reading() as session:  # whether it is there: what is in it need not be readable to start
        missing = session.get(DocumentRow, SAMPLE_PLAN) is None
    if missing and cases.get(HEAD_PHANTOM).deleted_at is None:
        sample = _sample_plan()
        plans.create(HEAD_PHANTOM, sample.name, sample.content, plan_id=SAMPLE_PLAN)


def _sample_plan() -> PlanFile:
    """The corridor and targets that the phantom was checked for."""
    data = json.loads((assets_dir() / _FOLDER / "phantom.json").read_text(encoding="utf-8"))
    content = {"points": data["corridor"]["points"], "targets": data["targets"]}
    return PlanFile(data["corridor"]["name"], content_from_json(content))


def _content(files: CaseFiles) -> CaseContent:
    description = json.loads((assets_dir() / _FOLDER / "phantom.json").read_text(encoding="utf-8"))
    surfaces = {name: f"{ASSET}{_FOLDER}/{file}" for name, file in _SURFACES.items()}
    volumes = {"head": load_head_ct(noise=False), "nose": load_nose_ct(noise=False)}
    infos = tuple(
        surface_info(name, files.surface(source), source, BONE_REPORT if name == BONE else None)
        for name, source in surfaces.items()
    )
    bone = infos[0]
    geometry = f"sha256:{_asset_hash(_SURFACES[BONE])}"
    inside = is_closed(files.surface(bone.source))
    return CaseContent(
        CaseFrame(description["frame"], assumed=False),
        infos,
        tuple(volume_info(name, volume, f"phantom:{name}") for name, volume in volumes.items()),
        tuple(CaseBead(bead["name"], to_triple(bead["centroid"])) for bead in description["beads"]),
        structures=(anatomy_structure("head", bone, geometry, Provenance("shipped"), inside),),
    )


def _with_imported(content: CaseContent, known: Case | None) -> CaseContent:
    """The content with the structures and volumes that the user imported into the case before."""
    if known is None or not known.protectable:
        return content
    names = {item.surface for item in known.protectable}
    surfaces = tuple(item for item in known.surfaces if item.name in names)
    return replace(
        content,
        surfaces=content.surfaces + surfaces,
        structures=content.structures + known.protectable,
        overlays=known.overlays,
    )


def is_shipped_head(content: CaseContent, files: CaseFiles) -> bool:
    """Whether stored files are copies of the surfaces and volumes that travel with this vfix."""
    surfaces = {item.name: item.source for item in own_surfaces(content)}
    volumes = {item.name: item.source for item in content.volumes}
    if set(surfaces) != set(_SURFACES) or {f"phantom:{name}" for name in volumes} != set(PHANTOM_CT):
        return False
    for name, source in surfaces.items():
        mesh, shipped = files.surface(source), files.surface(f"{ASSET}{_FOLDER}/{_SURFACES[name]}")
        if not np.array_equal(mesh.vertices, shipped.vertices) or not np.array_equal(mesh.faces, shipped.faces):
            return False
    return all(_same(files.volume(source), files.volume(f"phantom:{name}")) for name, source in volumes.items())


def _same(one: Volume, other: Volume) -> bool:
    grids = [(volume.hu.shape, *(part.tolist() for part in (volume.origin, volume.spacing, volume.direction)))
             for volume in (one, other)]  # fmt: skip
    if grids[0] != grids[1]:
        return False
    # The noise is added when the CT is read, and may be rounded otherwise on another machine.
    return bool(np.abs(one.hu.astype(np.int32) - other.hu.astype(np.int32)).max() <= 1)


def shipped_hash() -> str:
    """The content hash of the case that travels with this vfix: that of its assets."""
    digest = hashlib.sha256()
    for file in (*_SURFACES.values(), *_VOLUMES, "phantom.json"):
        digest.update(bytes.fromhex(_asset_hash(file)))
    return digest.hexdigest()


def _asset_hash(file: str) -> str:
    with (assets_dir() / _FOLDER / file).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
