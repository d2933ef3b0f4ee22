"""Imaging: files imported to cases, bone segmented, labels painted."""
