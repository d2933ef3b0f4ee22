"""Tables of the store. Times are UTC in ISO 8601; documents are JSON."""

from typing import Any

from sqlalchemy import JSON, ForeignKey, Index, Integer, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class Base(DeclarativeBase):
    """Base of every table."""


class CaseRow(Base):
    """A head: what was imported, and where its files are."""

    __tablename__ = "cases"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    created: Mapped[str] = mapped_column(String(32))
    deleted_at: Mapped[str | None] = mapped_column(String(32))
    content_hash: Mapped[str] = mapped_column(String(64))
    # Read when it is asked for: a damaged one must not keep the rest of its row from being read or replaced.
    document: Mapped[dict[str, Any]] = mapped_column(JSON, deferred=True)


class PlanRow(Base):
    """A plan; what it contains is the state of its history that `cursor` names."""

    __tablename__ = "plans"

    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    case_id: Mapped[str] = mapped_column(ForeignKey("cases.id"), index=True)
    case_hash: Mapped[str] = mapped_column(String(64))
    name: Mapped[str] = mapped_column(Text)
    created: Mapped[str] = mapped_column(String(32))
    modified: Mapped[str] = mapped_column(String(32))
    deleted_at: Mapped[str | None] = mapped_column(String(32))
    locked: Mapped[bool] = mapped_column()
    revision: Mapped[int] = mapped_column(Integer)
    cursor: Mapped[int] = mapped_column(Integer)


class PlanStateRow(Base):
    """One state of a plan's history: undo and redo move the plan's cursor over these."""

    __tablename__ = "plan_states"

    plan_id: Mapped[str] = mapped_column(ForeignKey("plans.id"), primary_key=True)
    position: Mapped[int] = mapped_column(Integer, primary_key=True)
    document: Mapped[dict[str, Any]] = mapped_column(JSON)


Index("plans_by_case_and_name", PlanRow.case_id, PlanRow.name)
