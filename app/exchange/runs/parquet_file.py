"""A run as a Parquet table; needs the extra `tables`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from app.exchange.runs.table import table_of
from vfix_engine.runtime.run import Run


def write_parquet(run: Run, told: dict[str, Any], path: Path) -> None:
    """Write the table in float64, with units; metadata of the schema are what it says of itself, see `about`."""
    table = table_of(run)
    fields = [
        pa.field(heading, pa.float64(), nullable=False, metadata={"unit": column.unit})
        for heading, column in zip(table.headings, table.columns, strict=True)
    ]
    metadata = {key: value if isinstance(value, str) else json.dumps(value) for key, value in told.items()}
    made = pa.table(list(table.rows.T.copy()), schema=pa.schema(fields, metadata=metadata))
    pq.write_table(made, path, compression="zstd")
