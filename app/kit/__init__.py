"""What every room uses: errors, names, values, text tables, caches, jobs, queues."""
