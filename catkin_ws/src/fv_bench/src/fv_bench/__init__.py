"""Speed and accuracy against references of the same run; each module with `run(quick)` is a bench."""
