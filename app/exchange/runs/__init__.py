"""Exports of a recorded run for other programs: a table as CSV or Parquet, and MCAP for Foxglove."""
