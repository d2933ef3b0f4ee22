"""CT volumes of a case: the grid, and the voxels as they are, for programs that cut their own slices."""

from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from fastapi import APIRouter, Header, Query, Response
from fastapi.responses import StreamingResponse
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.kit.errors import NotFound
from app.plans.model import NOTICE
from vfix_engine.files.volume import Volume

router = APIRouter(prefix="/cases/{case_id}", tags=["pictures"], responses=ERRORS)

Axis = Literal["axial", "coronal", "sagittal"]
VolumeName = Annotated[str | None, Query(max_length=64, description="of the case's volumes; else the widest")]
_NORMAL: dict[Axis, int] = {"sagittal": 0, "coronal": 1, "axial": 2}
_PIECE_BYTES = 2 << 20  # of a response that is sent piece by piece
_VOXELS: dict[str, Any] = {"application/octet-stream": {}}


class SliceRange(BaseModel):
    """Valid positions of a slice [mm]: L for sagittal, P for coronal, S for axial."""

    low: float
    high: float
    step: float


class VolumeMetadata(BaseModel):
    """Grid of a CT volume in LPS mm; `transform_index_to_lps` row by row.

    `origin_mm` is the centre of voxel (0, 0, 0), `direction` has the unit directions of i, j, k as columns, row by row.
    `revision` changes with grid and voxels, and `voxels` is where these are.
    """

    name: str
    shape: tuple[int, int, int]
    spacing_mm: tuple[float, float, float]
    transform_index_to_lps: list[list[float]]
    slices: dict[Axis, SliceRange]
    origin_mm: tuple[float, float, float]
    direction: list[list[float]]
    revision: str
    voxels: str


def volume_of(services: ServicesDep, case_id: str, name: str | None) -> Volume:
    """A volume of a case, the widest without a name. Raises NotFound."""
    volume = services.cases.volume(services.cases.get(case_id), name)
    if volume is None:
        raise NotFound("this case was made of a surface; it has no CT.")
    return volume


@router.get("/volume")
def volume_metadata(case_id: Identifier, services: ServicesDep, volume: VolumeName = None) -> VolumeMetadata:
    """Grid and slices of a CT volume."""
    grid = volume_of(services, case_id, volume)
    case = services.cases.get(case_id)
    name = volume or case.volumes[0].name
    k, j, i = grid.hu.shape
    low, high = grid.bounds
    step = float(grid.spacing.min())
    return VolumeMetadata(
        name=name,
        shape=(i, j, k),
        spacing_mm=(float(grid.spacing[0]), float(grid.spacing[1]), float(grid.spacing[2])),
        transform_index_to_lps=grid.transform_index_to_lps.tolist(),
        slices={axis: SliceRange(low=float(low[n]), high=float(high[n]), step=step) for axis, n in _NORMAL.items()},
        origin_mm=(float(grid.origin[0]), float(grid.origin[1]), float(grid.origin[2])),
        direction=grid.direction.tolist(),
        revision=services.cases.volume_revision(case, name),
        voxels=f"/api/v1/cases/{case_id}/volume/voxels?volume={name}",
    )


@router.get(
    "/volume/voxels",
    response_class=Response,
    responses={
        200: {"content": _VOXELS, "description": "int16 HU, little-endian, i fastest, then j, then k"},
        304: {"description": "the voxels of the revision that If-None-Match names are still those"},
    },
)
def voxels(
    case_id: Identifier,
    services: ServicesDep,
    volume: VolumeName = None,
    if_none_match: Annotated[str | None, Header(description="the ETag of voxels that are there already")] = None,
) -> Response:
    """All voxels of a volume, sent piece by piece and not compressed; `GET .../volume` has the grid.

    The ETag is the volume's revision: what it names never changes.
    """
    grid = volume_of(services, case_id, volume)
    etag = f'"{services.cases.volume_revision(services.cases.get(case_id), volume)}"'
    headers = {
        "ETag": etag,
        "X-Notice": NOTICE,
        "Cache-Control": "no-store",  # a browser's cache lies on its disk and outlives the planner
    }
    if if_none_match == etag:
        return Response(status_code=304, headers=headers)
    headers["Content-Length"] = str(grid.hu.nbytes)
    return StreamingResponse(pieces(grid.hu), media_type="application/octet-stream", headers=headers)


def pieces(hu: npt.NDArray[np.int16]) -> Iterator[bytes]:
    """The voxels (K, J, I) as bytes, i fastest, in pieces of about 2 MiB; no copy of the whole is made."""
    slices = max(1, _PIECE_BYTES // (hu[0].size * hu.itemsize))
    for first in range(0, len(hu), slices):
        yield hu[first : first + slices].astype("<i2", copy=False).tobytes()
