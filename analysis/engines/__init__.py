"""The engines: each module has NAME, find(), version(), prepare(scene, folder) and run(folder)."""
