"""Exchange: export and import of plans, points, tables and whole cases as files."""
