"""Experiments with simulated people: the apparatus, trials, what is measured of them, and the papers' tables."""
