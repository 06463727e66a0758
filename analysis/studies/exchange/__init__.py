"""Files that other programs write and read: contact problems in FCLIB's form."""
