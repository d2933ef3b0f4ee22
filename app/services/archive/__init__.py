"""A case with everything that belongs to it as one zip with checksums, and back."""

from app.services.archive.checking import is_archive
from app.services.archive.reading import ArchiveReader
from app.services.archive.writing import ArchiveWriter

__all__ = ["ArchiveReader", "ArchiveWriter", "is_archive"]
