"""The paper's measurement campaign, sailed again by a simulated VT 690."""
