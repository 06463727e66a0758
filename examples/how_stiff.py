"""How stiff is stiff enough, and what does it cost?

Of a crowd that pushes, the first moments are answered from a library of measured runs: for each
error that I can live with, the cheapest method that promises it, with its stiffness and price."""

from crowd_percussions import Question, advise, read_scene, stored_library

scene, library = read_scene("arch"), stored_library()
found = {}
for error in (0.5, 0.2, 0.1):
    question = Question(error=error, quantity="wall-load", against="rigid", methods=("lammps",))
    choice = advise(scene, question, library=library).choice
    found[error] = choice
    if choice is None:
        print(f"within {error:.0%}: no stiffness promises it")
    else:
        print(
            f"within {error:.0%}: {choice.law}, {choice.stiffness_N_per_m:.0e} N/m, "
            f"about {choice.cpu_seconds:.2g} CPU s"
        )
