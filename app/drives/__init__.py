"""Drives of any world: process, shared handle and lease, poses, recordings and stored runs."""
