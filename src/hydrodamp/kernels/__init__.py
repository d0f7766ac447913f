"""Everything that steps in time, on arrays alone, in one C99 library.

A plant and a model are tables here, so a new model compiles nothing. Read plant
(the arrays), then core (the functions), then library and csrc.
"""
