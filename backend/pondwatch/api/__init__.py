"""The REST border: limits, schemas, one file a resource."""
