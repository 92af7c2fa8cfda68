"""What a map looks like."""
