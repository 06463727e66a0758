"""The cases of the atlas, one file each."""
