"""What holds for all tests."""

from __future__ import annotations

import pytest

LONG = {"test_kill.py", "test_graph.py", "test_lattice.py", "test_upload.py", "test_page_whole.py", "test_page_live.py"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests in a browser come last: while one is open, its own event loop runs, and no other may be started.
    Two files at a time end together where the longest begin."""
    items.sort(key=lambda item: (item.get_closest_marker("browser") is not None, item.path.name not in LONG))
