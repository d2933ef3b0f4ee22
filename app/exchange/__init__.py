"""Exchange: plans, points, tables and whole cases to files of other programs and back."""
