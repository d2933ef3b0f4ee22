"""Readers of images, surfaces and frames from files, with validation; results are in LPS mm."""
