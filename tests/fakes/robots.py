"""Robots of a demo that set out when they are told to, and send nothing."""

from __future__ import annotations


class StillRobots:
    """`api.services.Robots`. urls: where they were told to upload to."""

    def __init__(self) -> None:
        self.urls: list[str] = []
        self.out = False

    def begin(self, url: str) -> bool:
        """Set out, unless they are out."""
        if self.out:
            return False
        self.out = True
        self.urls.append(url)
        return True

    def end(self) -> None:
        """Come in."""
        self.out = False
