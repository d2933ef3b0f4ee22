"""Rehearse: a robot that clients share, one of which holds its handle."""
