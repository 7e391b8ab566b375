"""What holds for all tests."""

from __future__ import annotations

import pytest

LONGEST = "test_kill.py"  # two files at a time end together where the longest begins


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests in a browser come last: while one is open, its own event loop runs, and no other may be started."""
    items.sort(key=lambda item: (item.get_closest_marker("browser") is not None, item.path.name != LONGEST))
