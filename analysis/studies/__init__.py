"""What is built from the stations, each by itself: no station imports a study."""
