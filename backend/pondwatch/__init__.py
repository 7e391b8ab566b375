"""Pondwatch: live, corrected mosaics of spent-fuel ponds from snapshots with wrong poses."""

__version__ = "0.1.0"
