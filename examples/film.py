"""How do the forces of a crowd change from frame to frame?

A small crowd walks up to a door. Each frame is solved; the picture moves. (`percussions film` makes
a page with bands and limits of such a run.)"""

from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.animation import FuncAnimation

from crowd_percussions import PercussionAnalysis, make, open_bodies, simulate

scene = make("arch", disks=30).with_run(duration_s=1.0, frames=10)
simulate(scene, "rigid", Path("walking"))
analysis = PercussionAnalysis(open_bodies("walking/bodies.dump"), scene).run()
largest = [frame.largest for frame in analysis.results.frames]  # N
print("N:", " ".join(f"{force:.0f}" for force in largest))

figure, axes = plt.subplots()


def show(number):
    figure.clear()
    analysis.plot(number, figure.add_subplot())


FuncAnimation(figure, show, frames=len(largest)).save("film.gif", writer="pillow", fps=4)
figure.savefig("film.png")
