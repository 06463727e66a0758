"""How much do forces depend on what I do not know, over many frames, on a cluster?

The same filmed crowd with bodies of three radii in three frames, a task each, on a Dask cluster.
Here it has two threads of this machine; `Client("tcp://…")` takes one of yours."""

from distributed import Client

from crowd_percussions import import_crowd, percussions_of, read_heads, shipped

SCENES, RADII, FRAMES = shipped("scenes"), (0.16, 0.18, 0.20), (400, 405, 410)


def largest(radius, frame):
    tracked = read_heads(SCENES / "gate_excerpt.txt", frame)
    crowd = import_crowd(tracked, radius=radius, room=SCENES / "rooms" / "gate.toml", name="filmed")
    return percussions_of(crowd.scene, crowd.scene.snapshot).largest  # N


with Client(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as client:
    forces = {
        radius: client.gather(client.map(largest, [radius] * len(FRAMES), FRAMES))
        for radius in RADII
    }
for radius, found in forces.items():
    print(f"radius {radius} m: largest force {min(found):.0f} to {max(found):.0f} N")
