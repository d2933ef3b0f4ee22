"""Bends of the distal links: search, Hermite curve and visual-motor map (Kwok 2013, section V)."""
