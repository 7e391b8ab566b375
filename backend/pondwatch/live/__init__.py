"""The websocket feed: a view of revisions, never the only copy of anything."""
