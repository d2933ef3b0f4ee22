"""The rigid tool under attack: scenes, operators, steps past them, and the oracle: brute force and coal."""
