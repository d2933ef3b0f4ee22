"""Painted labels: strokes on the slices of a case, with undo; their voxels, files and surfaces."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, Condition, ConditionDep, Flag, Identifier, ServicesDep, Wish
from app.api.jobs import JobPublic
from app.imaging.label_document import FIRST_COLOUR
from app.imaging.labels import PaintedDocument
from app.kit.names import MAX_NAME
from app.plans.model import NOTICE
from vfix_engine.anatomy.labels.painting import LEAST_RADIUS_MM, MOST_POINTS, MOST_RADIUS_MM, Stroke, runs_of
from vfix_engine.errors import ImageError, InputError

router = APIRouter(tags=["labels"], responses=ERRORS)

Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False, strict=True)]
Point = tuple[Coordinate, Coordinate, Coordinate]
LabelName = Annotated[str, Field(min_length=1, max_length=MAX_NAME)]
Colour = Annotated[str, Field(pattern=r"^#[0-9a-f]{6}$")]
Volume = Annotated[str, Field(max_length=64)]
Form = Annotated[Literal["seg.nrrd", "nii.gz"], Query(description="of the file")]


class LabelPublic(BaseModel):
    """A painted label. volume: whose grid it has. strokes: since its newest stored mask.

    structure: id of the structure made of it, else null; changed: whether it was painted since.
    """

    id: str
    name: str
    case_id: str
    volume: str
    colour: str
    strokes: int
    revision: int
    locked: bool
    can_undo: bool
    can_redo: bool
    created: str
    modified: str
    deleted_at: str | None
    unreadable: str
    structure: str | None
    changed: bool

    @classmethod
    def of(cls, services: ServicesDep, document: PaintedDocument) -> "LabelPublic":
        structure, changed = services.labels.structure(services.cases.get(document.case_id), document)
        known = {name: getattr(document, name) for name in cls.model_fields if hasattr(document, name)}
        content = document.content
        return cls(
            **known,
            volume=content.volume,
            colour=content.colour,
            strokes=len(content.strokes),
            structure=structure.id if structure else None,
            changed=changed,
        )


class LabelCreate(Wish):
    """structure: begin with the voxels inside that structure; volume: of the case, else the one of finest voxels."""

    name: LabelName
    colour: Colour = FIRST_COLOUR
    volume: Volume | None = None
    structure: Annotated[str, Field(max_length=64)] | None = None


class LabelUpdate(Wish):
    """One change of a label."""

    name: LabelName | None = None
    colour: Colour | None = None
    locked: Flag | None = None
    deleted: Flag | None = None


class StrokeCreate(Wish):
    """points: centres of the brush [LPS mm], joined by straight lines; normal: across a disc, a unit vector."""

    mode: Literal["paint", "erase"] = "paint"
    brush: Literal["disc", "ball"] = "ball"
    radius_mm: Annotated[float, Field(ge=LEAST_RADIUS_MM, le=MOST_RADIUS_MM, strict=True)]
    points: Annotated[list[Point], Field(min_length=1, max_length=MOST_POINTS)]
    normal: Point | None = None

    def stroke(self) -> Stroke:
        """What the service takes. Raises ImageError."""
        if self.brush == "disc" and self.normal is None:
            raise ImageError("a disc needs its normal, a unit vector across its plane.")
        return Stroke(self.mode, self.brush, self.radius_mm, tuple(self.points), self.normal or (0.0, 0.0, 1.0))


@router.get("/cases/{case_id}/labels")
def list_labels(
    case_id: Identifier, services: ServicesDep, include_deleted: Annotated[bool, Query()] = False
) -> list[LabelPublic]:
    """Painted labels of a case, oldest first."""
    services.cases.get(case_id)
    return [LabelPublic.of(services, each) for each in services.labels.documents.list(case_id, include_deleted)]


@router.post("/cases/{case_id}/labels", status_code=201)
def create_label(case_id: Identifier, wish: LabelCreate, services: ServicesDep, condition: ConditionDep) -> LabelPublic:
    """Make a label, empty or with the voxels inside a structure."""
    document = services.labels.create(
        case_id, wish.name, colour=wish.colour, volume=wish.volume, structure_id=wish.structure
    )
    return _told(services, condition, document)


@router.get("/labels/{label_id}")
def show_label(label_id: Identifier, services: ServicesDep, condition: ConditionDep) -> LabelPublic:
    """One label, deleted or not."""
    return _told(services, condition, services.labels.documents.get(label_id))


@router.patch("/labels/{label_id}")
def change_label(
    label_id: Identifier, change: LabelUpdate, services: ServicesDep, condition: ConditionDep
) -> LabelPublic:
    """One per request: rename, recolour, lock or unlock, delete or restore."""
    wanted, labels, expected = change.model_dump(exclude_none=True), services.labels, condition.expected()
    if len(wanted) != 1:
        raise InputError(f"change one thing of a label at a time, not {len(wanted)}.")
    if change.name is not None:
        document = labels.documents.rename(label_id, change.name, expected_revision=expected)
    elif change.colour is not None:
        document = labels.recolour(label_id, change.colour, expected_revision=expected)
    elif change.locked is not None:
        document = labels.documents.editor(label_id).set_locked(change.locked, expected_revision=expected)
    else:
        act = labels.documents.delete if change.deleted else labels.documents.restore
        document = act(label_id, expected_revision=expected)
    return _told(services, condition, document)


@router.post("/labels/{label_id}/strokes", status_code=201)
def add_stroke(label_id: Identifier, wish: StrokeCreate, services: ServicesDep, condition: ConditionDep) -> LabelPublic:
    """Paint or erase; one step of the history, durable before the response."""
    document = services.labels.stroke(label_id, wish.stroke(), expected_revision=condition.expected())
    return _told(services, condition, document)


@router.post("/labels/{label_id}/undo")
def undo_stroke(label_id: Identifier, services: ServicesDep, condition: ConditionDep) -> LabelPublic:
    """Undo the newest edit."""
    editor = services.labels.documents.editor(label_id)
    return _told(services, condition, editor.undo(expected_revision=condition.expected()))


@router.post("/labels/{label_id}/redo")
def redo_stroke(label_id: Identifier, services: ServicesDep, condition: ConditionDep) -> LabelPublic:
    """Redo the newest undone edit."""
    editor = services.labels.documents.editor(label_id)
    return _told(services, condition, editor.redo(expected_revision=condition.expected()))


@router.get(
    "/labels/{label_id}/voxels",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}}, "description": "uint32 run lengths, little-endian"}},
)
def label_voxels(label_id: Identifier, services: ServicesDep) -> Response:
    """The voxels as run lengths in the order of the volume's, i fastest: without, with, without, and so on.

    The ETag is the label's revision.
    """
    document = services.labels.documents.get(label_id)
    runs = runs_of(services.labels.mask(services.cases.get(document.case_id), document.content))
    headers = {"ETag": f'"{document.revision}"', "X-Notice": NOTICE, "Cache-Control": "no-store"}
    return Response(runs.astype("<u4").tobytes(), media_type="application/octet-stream", headers=headers)


@router.get(
    "/labels/{label_id}/file",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}}, "description": "the label as a file"}},
)
def label_as_file(label_id: Identifier, services: ServicesDep, form: Form = "seg.nrrd") -> Response:
    """The label as 3D Slicer's .seg.nrrd or a NIfTI label map."""
    headers = {"X-Notice": NOTICE, "Content-Disposition": f'attachment; filename="{label_id}.{form}"'}
    data = services.labels.file(label_id, form)
    return Response(data, media_type="application/octet-stream", headers=headers)


@router.post("/labels/{label_id}/surface", status_code=202)
def make_surface(label_id: Identifier, services: ServicesDep) -> JobPublic:
    """Make the label a structure, or give its structure the new border; the job's result is the structure's id."""
    return JobPublic.of(services.labels.start(label_id))


def _told(services: ServicesDep, condition: Condition, document: PaintedDocument) -> LabelPublic:
    condition.tell(document.revision)
    return LabelPublic.of(services, document)
