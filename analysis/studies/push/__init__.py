"""A row of people who are pushed from behind, against what penalty and rigid disks make of it."""
