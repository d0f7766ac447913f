"""Damping models: which terms act on which axis, and the numbers that go with them.

A model knows no vehicle and no log. Read ``model`` (the structure), ``catalog``
(the paper's eight), ``files`` (models of your own), then ``damping`` (a model
with numbers), ``damping_file`` (its JSON), ``published`` (coefficient sets from
the literature) and ``cite`` (where a model comes from).
"""
