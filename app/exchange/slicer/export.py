"""Export of a plan as a folder for 3D Slicer, written completely or not at all."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from app.cases.model import Case
from app.cases.service import CaseService
from app.cases.structures import Structure
from app.documents.documents import Documents
from app.exchange.slicer.marks import REMOVED, marks_of
from app.exchange.slicer.registrations import points_of, transforms_of
from app.exchange.slicer.scene import SceneNode, scene_text
from app.exchange.slicer.volume_file import write_nrrd
from app.planning.evaluation import Planning
from app.planning.shape_meshes import shape_surface
from app.plans.model import NOTICE, Plan
from app.registration.document import RegistrationContent, StoredRegistration
from app.store.errors import StorageError
from vfix_engine.errors import InputError
from vfix_engine.files.mesh_files import write_ply

SCENE = "scene.mrml"
_BONE, _STRUCTURE = "#e2d8c6", "#9b51f5"
_BONE_OPACITY, _REGION_OPACITY = 0.6, 0.35
_SHOWN_AS_SURFACES = {"sphere", "capsule", "capsules", "patch"}
_UNSAFE = re.compile(r"[^A-Za-z0-9_-]+")

Write = Callable[[Path], None]
Parts = list[tuple[SceneNode, Write]]


class SlicerExport:
    """Exports plans for 3D Slicer. A call takes seconds and may run in any thread."""

    def __init__(self, cases: CaseService, planning: Planning, registrations: Documents[RegistrationContent]) -> None:
        self._cases, self._planning, self._registrations = cases, planning, registrations

    def write(self, plan: Plan, folder: Path) -> tuple[str, ...]:
        """Write a plan and its case into a new or empty folder; return the names of the files, the scene first.

        Raises InputError if the folder is not empty, and StorageError if it cannot be written; nothing is left behind.
        """
        folder = folder.absolute()
        called = folder.name or folder
        try:
            taken = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
        except (OSError, ValueError) as error:  # such as a name that is too long
            why = error.strerror if isinstance(error, OSError) else error
            raise InputError(f"{called!s:.80} cannot be a folder: {why}; name another one.") from None
        if taken:
            raise InputError(f"{called} is there already and is not an empty folder; name another one.")
        half = folder.with_name(f".vfix-{secrets.token_hex(8)}")
        try:
            half.mkdir(parents=True)
            names = self._fill(plan, half)
            if folder.exists():
                folder.rmdir()
            os.replace(half, folder)
        except OSError as error:
            raise StorageError(f"{called} could not be written: {error.strerror or error}.") from error
        finally:
            shutil.rmtree(half, ignore_errors=True)
        return names

    def _fill(self, plan: Plan, folder: Path) -> tuple[str, ...]:
        case = self._cases.get(plan.case_id)
        parts = [*self._volumes(case), *self._surfaces(case), *self._regions(plan)]
        registrations = [one for one in self._registrations.list(case.id) if not one.unreadable]
        parts += [*self._marks(plan, case, registrations), *self._transforms(plan, registrations)]
        for node, write in parts:
            write(folder / node.file)
        (folder / SCENE).write_text(scene_text([node for node, _ in parts]), encoding="utf-8", newline="\n")
        return (SCENE, *(node.file for node, _ in parts))

    def _volumes(self, case: Case) -> Parts:
        names = _FileNames("volume", ".nrrd")

        def written(name: str) -> Write:
            def write(path: Path) -> None:
                volume = self._cases.volume(case, name)
                assert volume is not None
                write_nrrd(path, volume)

            return write

        return [
            (SceneNode("Volume", info.name, names.of(info.name), window=info.window), written(info.name))
            for info in case.volumes
        ]

    def _surfaces(self, case: Case) -> Parts:
        """Return the anatomy that the tool is driven in, and the other structures."""
        names = _FileNames("surface", ".ply")

        def part(structure: Structure, colour: str, opacity: float) -> tuple[SceneNode, Write]:
            node = SceneNode("Model", structure.name, names.of(structure.name), colour, opacity)
            return node, lambda path: write_ply(path, self._cases.case_surface(case.id, structure.surface))

        others = [part(one, one.colour or _STRUCTURE, 1.0) for one in case.protectable]
        return [part(case.anatomy, case.anatomy.colour or _BONE, _BONE_OPACITY), *others]

    def _marks(self, plan: Plan, case: Case, registrations: Sequence[StoredRegistration]) -> Parts:
        curve, remark = self._planning.curve(plan)
        names = _FileNames("mark", ".mrk.json")
        found: Parts = []
        for mark in [*marks_of(plan, case, curve, remark), *points_of(plan, registrations)]:
            words = str(mark.markup.get("description", NOTICE))
            node = SceneNode(
                mark.kind, mark.name, names.of(mark.name), mark.colour, 1.0, mark.visible, words,
                glyph_mm=mark.glyph_mm, named=mark.named,
            )  # fmt: skip
            found.append((node, _writer(mark.text())))
        return found

    def _regions(self, plan: Plan) -> Parts:
        """Return surfaces of protected structures and removed bone whose shapes are no markups in Slicer."""
        names = _FileNames("region", ".ply")
        regions = [(zone.name, zone.shape, zone.colour, zone.visible) for zone in plan.content.zones]
        regions += [(region.name, region.shape, REMOVED, True) for region in plan.content.removed_bone]
        found: Parts = []
        for name, shape, colour, visible in regions:
            if shape["kind"] not in _SHOWN_AS_SURFACES:
                continue
            try:
                surface = shape_surface(self._cases, plan.case_id, shape)
            except InputError:  # a patch of a removed structure: its hidden line still marks the place
                continue
            node = SceneNode("Model", f"{name} surface", names.of(name), colour, _REGION_OPACITY, visible)
            found.append((node, partial(write_ply, mesh=surface)))
        return found

    def _transforms(self, plan: Plan, registrations: Sequence[StoredRegistration]) -> Parts:
        """Return the registrations of the case as transforms, which move nothing until the user applies them."""
        names = _FileNames("registration", ".tfm")
        return [
            (SceneNode("Transform", name, names.of(name), description=words), _writer(text))
            for name, words, text in transforms_of(plan, registrations)
        ]


class _FileNames:
    """File names made from display names: ASCII, and unique also on a case-insensitive file system."""

    def __init__(self, prefix: str, ending: str) -> None:
        self._prefix, self._ending = prefix, ending
        self._taken: set[str] = set()

    def of(self, name: str) -> str:
        stem = f"{self._prefix}-{_UNSAFE.sub('-', name).strip('-')[:40]}".rstrip("-")
        wanted, number = stem, 1
        while wanted.lower() in self._taken:
            number += 1
            wanted = f"{stem}-{number}"
        self._taken.add(wanted.lower())
        return wanted + self._ending


def _writer(text: str) -> Write:
    def write(path: Path) -> None:
        path.write_bytes(text.encode("utf-8"))

    return write
