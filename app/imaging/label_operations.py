"""What can be done to painted labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import msgspec
from msgspec import Meta

from app.documents import Document
from app.imaging.label_document import FIRST_COLOUR, LABEL, LabelStroke, PaintedLabel, Points, Radius
from app.imaging.labels import PaintedLabels
from app.operations.fields import Colour, Identifier, Name, Position
from app.operations.operation import Context, Creation, Edit, Option, Verb
from app.operations.public import DocumentPublic, common_values
from app.operations.spec import DocumentSpec
from app.operations.standard import Delete, Redo, Rename, Restore, SetDeleted, SetLocked, Undo
from vfix_engine.errors import ImageError

Labels = Context[PaintedLabel, PaintedLabels]
_BALL = (Option("--radius-mm", "radius_mm", "MM", "of the ball (1)", 1.0),)
Volume = Annotated[str, Meta(max_length=64)]


@dataclass(frozen=True, kw_only=True)
class LabelPublic(DocumentPublic):
    """A painted label. volume: whose grid it has. strokes: since its newest stored mask.

    structure: id of the structure made of it, else null; changed: whether it was painted since.
    """

    volume: str
    colour: str
    strokes: int
    structure: str | None
    changed: bool

    @classmethod
    def of(cls, labels: PaintedLabels, document: Document[PaintedLabel]) -> LabelPublic:
        content = document.content
        structure, changed = labels.structure(labels.case_of(document), document)
        return cls(
            volume=content.volume,
            colour=content.colour,
            strokes=len(content.strokes),
            structure=structure.id if structure else None,
            changed=changed,
            **common_values(document),
        )


class CreateLabel(Creation, frozen=True):
    """Make a label, empty or with the voxels inside a structure.

    Its grid is that of a `volume` of the case, by default the one of the finest voxels.
    """

    rest = "POST /cases/{case_id}/labels"
    message = "label.new"
    aliases: ClassVar[Mapping[str, str]] = {"structure": "structure_id"}
    verb = (
        Verb(
            "case labels --new",
            "make a label, empty or with --from",
            options=(Option("--from", "structure", "STRUCTURE", "with --new: the voxels inside that one"),),
        ),
    )
    name: Name
    colour: Colour = FIRST_COLOUR
    volume: Volume | None = None
    structure: Identifier | None = None

    def create(self, context: Labels, case_id: str) -> Document[PaintedLabel]:
        return context.service.create(
            case_id, self.name, colour=self.colour, volume=self.volume, structure_id=self.structure
        )


class DrawStroke(Edit, frozen=True):
    """Paint or erase along `points`, the centres of the brush in LPS mm, which straight lines join.

    A `disc` is one layer of voxels across its `normal`, a unit vector. A stroke that reaches no voxel is refused.
    """

    rest = "POST /labels/{id}/strokes"
    status = 201
    message = "label.stroke"
    verb = (
        Verb("case labels --paint", "draw a ball along these places, LPS mm", {"mode": "paint"}, _BALL),
        Verb("case labels --erase", "take a ball along these places away", {"mode": "erase"}, _BALL),
    )
    radius_mm: Radius
    points: Points
    mode: Literal["paint", "erase"] = "paint"
    brush: Literal["disc", "ball"] = "ball"
    normal: Position | None = None

    @property
    def stroke(self) -> LabelStroke:
        """What is stored of it. Raises ImageError."""
        if self.brush == "disc" and self.normal is None:
            raise ImageError("a disc needs its normal, a unit vector across its plane.")
        return LabelStroke(self.mode, self.brush, self.radius_mm, self.points, self.normal or (0.0, 0.0, 1.0))

    def run(self, context: Labels, document_id: str) -> Document[PaintedLabel]:
        context.service.check_reach(document_id, self.stroke)  # before the edit, since a volume takes long to read
        return super().run(context, document_id)

    def apply(self, content: PaintedLabel, context: Labels) -> PaintedLabel:
        return context.service.with_stroke(context.case_id, content, self.stroke)


class Recolour(Edit, frozen=True):
    """Draw it in another colour."""

    rest = "PATCH /labels/{id}"
    message = "label.change"
    colour: Colour

    def apply(self, content: PaintedLabel, context: Labels) -> PaintedLabel:
        return msgspec.structs.replace(content, colour=self.colour)


class RenameLabel(Rename, frozen=True):
    __doc__ = Rename.__doc__
    message = "label.change"


class LockLabel(SetLocked, frozen=True):
    __doc__ = SetLocked.__doc__
    message = "label.change"


class DeleteLabel(Delete, frozen=True):
    """Take it off the list; its structure stays."""

    verb = "case labels --delete"


class UndoStroke(Undo, frozen=True):
    __doc__ = Undo.__doc__
    verb = "case labels --undo"


class RedoStroke(Redo, frozen=True):
    __doc__ = Redo.__doc__
    verb = "case labels --redo"


SPEC = DocumentSpec(
    kind=LABEL,
    path="labels",
    id="label_id",
    public=LabelPublic,
    public_of=LabelPublic.of,
    operations=(
        CreateLabel, RenameLabel, Recolour, LockLabel, SetDeleted, DrawStroke, UndoStroke, RedoStroke, DeleteLabel,
        Restore,
    ),
    service="labels",
)  # fmt: skip
