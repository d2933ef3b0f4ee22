"""Plans become documents of the kind 'plan', with settings apart from the history; adds runs.

The text of every state is copied unchanged. The settings are those of the current state.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision: str | None = "0001"
branch_labels: str | None = None
depends_on: str | None = None

# A state that is not JSON is copied and refused when read: one damaged plan must not block the others.
_SETTINGS = """
CASE WHEN json_valid(document) THEN
    CASE WHEN json_type(document, '$.settings') = 'object' THEN json_extract(document, '$.settings') END
END
"""


def upgrade() -> None:
    op.create_table(
        "documents",
        sa.Column("id", sa.String(64), primary_key=True),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("case_id", sa.String(64), sa.ForeignKey("cases.id"), nullable=False),
        sa.Column("case_hash", sa.String(64), nullable=False),
        sa.Column("name", sa.Text, nullable=False),
        sa.Column("created", sa.String(32), nullable=False),
        sa.Column("modified", sa.String(32), nullable=False),
        sa.Column("deleted_at", sa.String(32)),
        sa.Column("locked", sa.Boolean, nullable=False),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("cursor", sa.Integer, nullable=False),
        sa.Column("settings", sa.JSON, nullable=False),
    )
    op.create_index("ix_documents_case_id", "documents", ["case_id"])
    op.create_index("documents_by_case_and_kind", "documents", ["case_id", "kind"])
    op.create_table(
        "document_states",
        sa.Column("document_id", sa.String(64), sa.ForeignKey("documents.id"), primary_key=True),
        sa.Column("position", sa.Integer, primary_key=True),
        sa.Column("schema", sa.String(40), nullable=False),
        sa.Column("refs", sa.JSON, nullable=False),
        sa.Column("content", sa.JSON, nullable=False),
    )
    op.execute(
        f"""
        INSERT INTO documents (id, kind, case_id, case_hash, name, created, modified, deleted_at, locked, revision,
                               cursor, settings)
        SELECT id, 'plan', case_id, case_hash, name, created, modified, deleted_at, locked, revision, cursor,
               COALESCE((SELECT {_SETTINGS} FROM plan_states WHERE plan_id = plans.id AND position = cursor), '{{}}')
        FROM plans
        """
    )
    op.execute(
        """
        INSERT INTO document_states (document_id, position, schema, refs, content)
        SELECT plan_id, position, 'vfix-plan/1', '[{"kind"\\: "structure", "id"\\: "bone"}]', document FROM plan_states
        """
    )
    op.drop_table("plan_states")
    op.drop_table("plans")
    op.create_table(
        "runs",
        sa.Column("id", sa.String(64), primary_key=True),
        sa.Column("case_id", sa.String(64), sa.ForeignKey("cases.id")),
        sa.Column("plan_id", sa.String(64), sa.ForeignKey("documents.id")),
        sa.Column("recorded", sa.String(32), nullable=False),
        sa.Column("size_bytes", sa.Integer, nullable=False),
        sa.Column("manifest", sa.JSON, nullable=False),
        sa.Column("files", sa.JSON, nullable=False),
    )
    op.create_index("ix_runs_case_id", "runs", ["case_id"])
    op.create_index("ix_runs_plan_id", "runs", ["plan_id"])
