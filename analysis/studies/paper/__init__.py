"""The paper's examples, made again: sections of a page, each figure with the numbers behind it."""
