"""The run report: one HTML file that needs no network, made from whatever a run folder holds."""
