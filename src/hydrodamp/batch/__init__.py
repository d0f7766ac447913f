"""Batch identification: sufficient statistics of many logs, fits of groups, change points."""
