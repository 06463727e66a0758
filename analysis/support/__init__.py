"""What every room needs once: files, progress, cache, processes, the machine."""
