"""The engines: each has prepare(scene, folder) and run(folder)."""
