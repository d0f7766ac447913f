"""Records with values that a test has changed."""

from dataclasses import replace


def set_values(record, name, *changes):
    """Return a record whose array has a value in each place; a function gets the earlier one."""
    values = getattr(record, name).copy()
    for place, value in changes:
        values[place] = value(values[place]) if callable(value) else value
    return replace(record, **{name: values})
