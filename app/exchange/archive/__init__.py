"""Archives: a case with its documents and files as one zip with checksums, written and read."""

from app.exchange.archive.checking import is_archive
from app.exchange.archive.reading import ArchiveReader
from app.exchange.archive.writing import ArchiveWriter

__all__ = ["ArchiveReader", "ArchiveWriter", "is_archive"]
