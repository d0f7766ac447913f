"""From a recording in any form to a log: formats, clocks, mappings, probing."""
