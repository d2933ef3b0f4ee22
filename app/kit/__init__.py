"""Utilities of the application: errors, names, values, text tables, caches, jobs, queues."""
