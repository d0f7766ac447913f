"""Local pages for a browser: a view of logs, mapping, vehicle, model and results as files."""
