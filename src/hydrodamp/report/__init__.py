"""Reports of results: tables, documents, figures and HTML pages."""
