"""Pictures of a case: CT slices as JPEG, and surfaces as binary STL or bare arrays."""

import json
import struct
from typing import Annotated, Literal

import cv2
import numpy as np
from fastapi import APIRouter, Query, Response
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.services.errors import NotFound
from app.services.plan_model import NOTICE
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.volume import Volume

router = APIRouter(prefix="/cases/{case_id}", tags=["pictures"], responses=ERRORS)

Axis = Literal["axial", "coronal", "sagittal"]
_QUALITY = 90
_NORMAL = {"sagittal": 0, "coronal": 1, "axial": 2}
_FINITE = {"allow_inf_nan": False}


class SliceRange(BaseModel):
    """Positions [mm] that a slice may have: L for sagittal, P for coronal, S for axial."""

    low: float
    high: float
    step: float


class VolumeMetadata(BaseModel):
    """Grid of a CT volume in LPS mm; `transform_index_to_lps` row by row."""

    name: str
    shape: tuple[int, int, int]
    spacing_mm: tuple[float, float, float]
    transform_index_to_lps: list[list[float]]
    slices: dict[Axis, SliceRange]


def _volume(services: ServicesDep, case_id: str, name: str | None) -> Volume:
    volume = services.cases.volume(case_id, name)
    if volume is None:
        raise NotFound("this case was made of a surface; it has no CT.")
    return volume


VolumeName = Annotated[str | None, Query(max_length=64, description="of the case's volumes; else the widest")]


@router.get("/volume")
def volume_metadata(case_id: Identifier, services: ServicesDep, volume: VolumeName = None) -> VolumeMetadata:
    """Where a CT volume is, and which slices it has."""
    grid = _volume(services, case_id, volume)
    k, j, i = grid.hu.shape
    low, high = grid.bounds
    step = float(grid.spacing.min())
    return VolumeMetadata(
        name=volume or services.cases.get(case_id).volumes[0].name,
        shape=(i, j, k),
        spacing_mm=(float(grid.spacing[0]), float(grid.spacing[1]), float(grid.spacing[2])),
        transform_index_to_lps=grid.transform_index_to_lps.tolist(),
        slices={axis: SliceRange(low=float(low[n]), high=float(high[n]), step=step) for axis, n in _NORMAL.items()},  # type: ignore[misc]
    )


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
    """A slice at an LPS position; `X-Transform-Pixel-To-LPS` holds the 4x4 matrix of (column, row, 0, 1), in mm."""
    image, transform = _volume(services, case_id, volume).slice_image(axis, position_mm, window, level)
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
) -> Response:
    """A surface, little-endian. `arrays`: uint32 vertices, uint32 triangles, float32 (V, 3), uint32 (F, 3)."""
    mesh = services.cases.case_surface(case_id, name)
    data = _arrays(mesh) if form == "arrays" else _stl(mesh)
    media_type = "application/octet-stream" if form == "arrays" else "model/stl"
    return Response(data, media_type=media_type, headers={"X-Notice": NOTICE, "X-Frame": "LPS", "X-Unit": "mm"})


def _arrays(mesh: TriangleMesh) -> bytes:
    counts = struct.pack("<II", len(mesh.vertices), len(mesh.faces))
    return counts + mesh.vertices.astype("<f4").tobytes() + mesh.faces.astype("<u4").tobytes()


def _stl(mesh: TriangleMesh) -> bytes:
    records = np.zeros(len(mesh.faces), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records["normal"], records["corners"] = mesh.face_normals, mesh.triangles
    head = f"SPACE=LPS UNIT=mm {NOTICE}".encode("ascii").ljust(80)
    return head + struct.pack("<I", len(records)) + records.tobytes()
