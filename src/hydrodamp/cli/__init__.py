"""The command line: one module a command, assembled in ``main``.

Read ``main``, then ``compare`` with what it is made of: ``options`` (what may
be said), ``choose`` (models, methods), ``select`` (logs), ``experiment`` (fits),
``output`` and ``progress`` (what is printed where), ``guard`` (errors to exit
statuses). Heavy imports are made inside the commands, so that help is instant.
"""
