"""Map, evaluation, utility and view gain."""
