"""Ponds, cameras and swarms by seed; a client like any base station."""
