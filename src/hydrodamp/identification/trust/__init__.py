"""What the data determine, and what speaks against a fit.

``identifiability`` grades coefficients, on ``excitation``, ``collinearity`` and ``grades``;
``diagnostics`` look at ``residuals`` and ``endogeneity``; ``bootstrap`` draws blocks again.
"""
