"""A season of logs: each folded by itself, merged by group, one table out."""
