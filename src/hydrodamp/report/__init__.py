"""Presentation, apart from the data: tables, documents and files of results."""
