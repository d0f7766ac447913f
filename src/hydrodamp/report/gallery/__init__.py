"""The pictures of a run, each with what to see in it, and what the log determines.

Read ``picture`` (a picture and its words) and ``findings`` (what a report shows beside a
comparison), then ``examine`` (how they are made from the training log), with ``of_the_data``,
``of_the_fit``, ``of_the_replays`` and ``of_the_adaptation`` (which pictures, with which
words), and ``folder`` (the files, both ways).
"""
