"""Work against precision: what each method costs on a scene, and how wrong it is."""
