"""Mappings: assign topics and columns of any recording to the channels of the canonical form."""

from hydrodamp.ingest.mapping.log_mapping import LogMapping, json_schema, presets, read_mapping

__all__ = ["LogMapping", "json_schema", "presets", "read_mapping"]
