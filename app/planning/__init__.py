"""Planning: evaluation of a plan in its head (dry run, clearance, verdict, previews, suggested paths)."""
