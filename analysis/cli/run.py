"""percussions run."""

from dataclasses import replace
from pathlib import Path

from analysis.cli.app import drop_none, progress, say_runs, warn
from analysis.cli.options import Out, Positive, Processes, Share


def run(
    scene: str,
    *,
    engine: str | None = None,
    error: str | None = None,
    stiffness: Positive | None = None,
    wall_stiffness: Positive | None = None,
    restitution: Share | None = None,
    law: str | None = None,
    time_step: Positive | None = None,
    duration: Positive | None = None,
    impulses: bool = False,
    ranks: Processes = 1,
    out: Out = Path("out"),
) -> None:
    """Run a scene with one engine.

    engine: lammps, yade or rigid. Default: lammps, or what --error chooses.
    error: Let law, stiffness and time step be advised for this error, such as 5%.
    stiffness: Contact stiffness in N/m, instead of the scene's.
    wall_stiffness: The same of walls in N/m, instead of the scene's.
    restitution: Asked restitution, 0 to 1.
    law: hooke, hertz, body or body_hertz.
    time_step: Time step in s, instead of the rule's.
    duration: Simulated time in s.
    impulses: Sum the impulses of contacts between frames, for `exposure`. A run of LAMMPS then takes
        1.5 to 5 times as long. The rigid engine always sums them.
    ranks: Processes of MPI that share the run. LAMMPS only.

    Example: percussions run arch --engine yade --stiffness 1e7"""
    from analysis.engines.run import EngineRun, check_before
    from analysis.scene.scene import read_scene

    chosen = read_scene(scene)
    if error is not None and (stiffness, law, time_step) != (None, None, None):
        raise ValueError(
            "error: it chooses law, stiffness and time step. "
            "Leave out --law, --stiffness, --time-step"
        )
    for warning in chosen.check(scene):
        warn(warning)
    contact = {"stiffness_N_per_m": stiffness, "wall_stiffness_N_per_m": wall_stiffness}
    chosen = chosen.with_contact(**drop_none(**contact, restitution=restitution, law=law))
    timing = drop_none(time_step_s=time_step, duration_s=duration, impulses=impulses or None)
    chosen = chosen.with_run(**timing)
    if error is not None:
        from analysis.advice.choice import scene_within

        chosen, engine, choice = scene_within(chosen, error, engine)
        print(f"advised: {choice}")
    wanted = replace(EngineRun.of(chosen, engine or "lammps", out), ranks=ranks)
    if not wanted.is_finished():
        check_before(wanted.scene, wanted.engine, wanted.folder)
        say_runs([wanted], f"{chosen.name} with {wanted.engine}")
    with progress() as report:
        record = wanted.record(report)
    print(
        f"{wanted.folder}: {record.steps} steps of {record.time_step_s:.3g} s, restitution "
        f"obtained {record.restitution_most:.3g}, {record.cpu_seconds:.2f} CPU s"
    )
