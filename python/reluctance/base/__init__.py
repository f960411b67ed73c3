"""What knows nothing of motors: errors, units, files, schema, cache, figures. Imports nothing of
the package but itself."""
