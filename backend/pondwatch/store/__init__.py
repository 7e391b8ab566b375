"""The only code that touches a database or a blob."""
