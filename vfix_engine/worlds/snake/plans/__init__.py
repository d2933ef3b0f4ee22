"""What takes longer than a step: plans of a worker, and their adoption."""
