"""What stands between the robots and the server: bundles, spooling and uploading."""
