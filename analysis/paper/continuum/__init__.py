"""Section 3 of the paper, a folder per figure."""
