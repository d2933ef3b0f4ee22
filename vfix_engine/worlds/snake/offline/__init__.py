"""Drives without a clock: scripts, operators, reports, recorded runs."""
