"""Simulated people who do the two tasks of Kwok 2013: what they see, how their hand moves, what they do with it."""
