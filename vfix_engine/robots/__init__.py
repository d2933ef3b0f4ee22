"""Robots and tools over Pinocchio."""
