"""Imaging: import of files as cases, segmentation of CTs, painted labels."""
