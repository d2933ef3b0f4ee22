"""A case with everything that belongs to it as one zip with checksums, and back."""

from app.exchange.archive.checking import is_archive
from app.exchange.archive.reading import ArchiveReader
from app.exchange.archive.writing import ArchiveWriter

__all__ = ["ArchiveReader", "ArchiveWriter", "is_archive"]
