"""What every package may use, and that knows no robot. Importing it costs nothing; see its modules."""
