"""Operations on documents, each declared once: REST, messages, verbs, types and tests are made of the declaration."""

from app.operations.operation import Change, Context, Creation, Edit, Operation
from app.operations.registry import spec_named, specs
from app.operations.spec import DocumentSpec

__all__ = ["Change", "Context", "Creation", "DocumentSpec", "Edit", "Operation", "spec_named", "specs"]
