"""Building a map: what to decide, in many processes or on a cluster."""
