"""Section 2 of the paper, a file per figure."""
