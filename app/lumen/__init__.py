"""Lumens: the shipped colon, routes through a lumen as documents, and what is computed of a route."""
