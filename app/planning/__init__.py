"""Planning: a plan evaluated in its head: dry run, clearance, verdict, previews, suggestions."""
