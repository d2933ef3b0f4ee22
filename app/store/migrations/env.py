"""Alembic's entry: migrate on the connection of the store."""

from alembic import context

from app.store.models import Base

context.configure(connection=context.config.attributes["connection"], target_metadata=Base.metadata)
with context.begin_transaction():
    context.run_migrations()
