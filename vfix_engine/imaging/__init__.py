"""Imaging: CT volumes and surfaces in, checked, LPS mm."""
