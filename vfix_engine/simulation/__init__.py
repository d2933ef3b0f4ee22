"""Simulation: rehearsal, operators, recorder, real-time process."""
