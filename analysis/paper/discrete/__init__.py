"""Section 2 of the paper, a folder per figure."""
