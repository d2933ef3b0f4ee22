"""The checksum of OpenIGTLink: CRC-64 of ECMA-182, polynomial 42F0E1EBA9EA3693, not reflected, beginning with 0.

Source: http://openigtlink.org/protocols/v2_header.html
"""

_POLYNOMIAL = 0x42F0E1EBA9EA3693
_MASK = (1 << 64) - 1


def _entry(value: int) -> int:
    register = value << 56
    for _ in range(8):
        register = (register << 1) ^ (_POLYNOMIAL if register >> 63 else 0)
        register &= _MASK
    return register


_TABLE = tuple(_entry(value) for value in range(256))


def crc64(data: bytes) -> int:
    """Checksum of a message's body."""
    register = 0
    for value in data:
        register = ((register << 8) & _MASK) ^ _TABLE[(register >> 56) ^ value]
    return register
