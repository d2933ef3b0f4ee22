"""Sandbox: readers of untrusted files in a process of their own, without access to anything else."""
