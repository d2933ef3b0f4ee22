"""Pictures of a case: CT slices as JPEG, and surfaces as binary STL or arrays."""

import json
import struct
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from fastapi import APIRouter, Query, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.volumes import Axis, VolumeName, volume_of
from app.plans.model import NOTICE
from vfix_engine.anatomy.scan_ends import faces_at_ends, source_of
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

router = APIRouter(prefix="/cases/{case_id}", tags=["pictures"], responses=ERRORS)

_QUALITY = 90
_FINITE = {"allow_inf_nan": False}


@router.get(
    "/slices/{axis}",
    response_class=Response,
    responses={200: {"content": {"image/jpeg": {}}, "description": "Grey picture; see the headers for where it is"}},
)
def slice_picture(
    case_id: Identifier,
    axis: Axis,
    services: ServicesDep,
    position_mm: Annotated[float, Query(ge=-1e4, le=1e4, **_FINITE)],
    window: Annotated[float, Query(gt=0, le=20_000, **_FINITE)] = 2000.0,
    level: Annotated[float, Query(ge=-10_000, le=20_000, **_FINITE)] = 400.0,
    volume: VolumeName = None,
) -> Response:
    """A slice at an LPS position; `X-Transform-Pixel-To-LPS` has the 4x4 matrix of (column, row, 0, 1), in mm."""
    import cv2  # imported here: slow to load

    image, transform = volume_of(services, case_id, volume).slice_image(axis, position_mm, window, level)
    _, encoded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    headers = {
        "X-Transform-Pixel-To-LPS": json.dumps(transform.tolist(), separators=(",", ":")),
        "X-Notice": NOTICE,
        "Cache-Control": "no-store",  # a browser's cache lies on its disk and outlives the planner
    }
    return Response(encoded.tobytes(), media_type="image/jpeg", headers=headers)


@router.get(
    "/surfaces/{name}",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}, "model/stl": {}}, "description": "LPS mm"}},
)
def surface(
    case_id: Identifier,
    name: Annotated[str, "of the case's surfaces"],
    services: ServicesDep,
    form: Annotated[Literal["arrays", "stl"], Query(alias="format")] = "arrays",
    open_ends: bool = False,
) -> Response:
    """A surface, little-endian. `arrays`: uint32 vertices, uint32 triangles, float32 (V, 3), uint32 (F, 3).

    open_ends: without the flat faces that close it where the CT ends.
    """
    mesh = services.cases.case_surface(case_id, name)
    if open_ends:
        mesh = _without_ends(mesh, services.cases.volumes(services.cases.get(case_id)))
    data = _arrays(mesh) if form == "arrays" else _stl(mesh)
    media_type = "application/octet-stream" if form == "arrays" else "model/stl"
    return Response(data, media_type=media_type, headers={"X-Notice": NOTICE, "X-Frame": "LPS", "X-Unit": "mm"})


def _without_ends(mesh: TriangleMesh, volumes: Sequence[Volume]) -> TriangleMesh:
    volume = source_of(mesh, volumes)
    return mesh if volume is None else TriangleMesh(mesh.vertices, mesh.faces[~faces_at_ends(mesh, volume)])


def _arrays(mesh: TriangleMesh) -> bytes:
    counts = struct.pack("<II", len(mesh.vertices), len(mesh.faces))
    return counts + mesh.vertices.astype("<f4").tobytes() + mesh.faces.astype("<u4").tobytes()


def _stl(mesh: TriangleMesh) -> bytes:
    records = np.zeros(len(mesh.faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["normal"], records["corners"] = mesh.face_normals, mesh.triangles
    head = f"SPACE=LPS UNIT=mm {NOTICE}".encode("ascii").ljust(80)
    return head + struct.pack("<I", len(records)) + records.tobytes()
