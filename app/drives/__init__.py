"""Drives: recordings of a plan's rehearsals, kept and replayed."""
