"""Plans: the document, its parts, edits, versions and differences."""
