"""Plan: points, targets and the path, and what the tool makes of it."""
