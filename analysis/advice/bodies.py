"""Advice for crowds as soft as people: whether rigid disks still answer, and the run that does."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

from analysis.advice.library import expected_seconds
from analysis.engines.softness import (
    NO_CROWD,
    WITH_CARE,
    Body,
    RigidOver,
    judged,
    known_bodies,
    rigid_over_soft,
    softness_of,
)
from analysis.pages.bodies import ladder
from analysis.pages.numbers import interval, percent, seconds, signed
from analysis.scene.law import AS_HERTZ
from analysis.scene.scene import Scene
from analysis.support.files import write_json

# Asked of the command, and the quantities of the measured ladder that answer.
OF_BODIES = {
    "mean-wall-load": "wall_load",
    "mean-person-load": "person_mean",
    "contact-force-95": "contact_95",
    "largest-person-load": "person_largest",
    "flow": "flow",
    "door-density": "density",
}
# Walls are never softer than this s makes them: else people pass them.
WALLS = 3.5
# The body whose force has a law of its own.
CHEST = "chest"


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyAdvice:
    """Hold what was asked of a crowd as soft as people, and what is advised.

    rigid: by how much rigid disks are above such bodies; None where that was not measured"""

    scene: Scene
    quantity: str
    asked: float
    body: Body
    softness: tuple[float, float]  # s with the stiffest and with the softest of these bodies
    rigid: RigidOver | None
    engine: str  # that answers, "" where none does
    command: str  # that runs it
    cpu_seconds: float  # s, what the run should cost


def advise_bodies(
    scene: Scene, error: float, quantity: str, methods: Sequence[str], body: str
) -> BodyAdvice:
    """Choose the cheapest way to a mean over time of a crowd whose bodies are as stiff as a source
    says: rigid disks where they were measured to be within the error of it, else an engine with
    springs of that stiffness.

    Raises ValueError for a quantity, a body or a scene that has no answer."""
    known = known_bodies()
    if body not in known:
        raise ValueError(f"body: unknown {body!r}. There are: {', '.join(known)}")
    if quantity not in OF_BODIES:
        raise ValueError(
            f"quantity: {quantity} is not known of soft bodies. There are: {', '.join(OF_BODIES)}"
        )
    if scene.drive is None:
        raise ValueError(f"body: {scene.name} is an impact, and s is of a crowd that is driven")
    hardest, softest = softness_of(scene, known[body])
    found = rigid_over_soft(softest, hardest)
    rigid = None if found is None else found[OF_BODIES[quantity]]
    offered = []
    if rigid and rigid.worst <= error and "rigid" in methods:
        offered.append((expected_seconds(scene, "rigid"), "rigid", ""))
    soft, words = soft_run(scene, known[body])
    for name in methods:
        if name != "rigid" and softest <= valid_to(quantity):
            offered.append((expected_seconds(soft, name), name, words))
    price, engine, words = min(offered, default=(0.0, "", ""))
    return BodyAdvice(
        scene=scene,
        quantity=quantity,
        asked=error,
        body=known[body],
        softness=(hardest, softest),
        rigid=rigid,
        engine=engine,
        command=f"percussions run {scene.name} --engine {engine}{words}" if engine else "",
        cpu_seconds=price,
    )


def valid_to(quantity: str) -> float:
    """Give the largest s of a soft run that answers: forces need disks that do not overlap by a
    radius."""
    return NO_CROWD if quantity in ("flow", "door-density") else WITH_CARE


def soft_run(scene: Scene, body: Body) -> tuple[Scene, str]:
    """Give a driven scene with bodies as stiff as a source says, and the options of its run: the
    law of chests, or the geometric mean of its stiffnesses with walls that hold."""
    if body.name == CHEST:
        return scene.with_contact(law=AS_HERTZ), f" --law {AS_HERTZ}"
    drive, disks = scene.drive, scene.snapshot
    assert drive is not None
    push = drive.push(float(disks.mass.sum()))
    k = float(f"{sqrt(body.low_N_per_m * body.high_N_per_m):.2g}")
    walls = float(f"{max(k, push / (WALLS * float(disks.radius.mean()))):.2g}")
    made = scene.with_contact(law="hooke", stiffness_N_per_m=k, wall_stiffness_N_per_m=walls)
    return made, f" --stiffness {k:g} --wall-stiffness {walls:g}"


def body_lines(advice: BodyAdvice) -> Iterator[str]:
    """Write the question, what rigid disks would say, and the choice, a line each."""
    body, rigid = advice.body, advice.rigid
    stiffness = interval([end / 1000 for end in (body.low_N_per_m, body.high_N_per_m)])
    softest = advice.softness[1]
    yield (
        f"{advice.scene.name}: {advice.quantity} of bodies of {stiffness} kN/m ({body.words}, "
        f"{body.source}), within {percent(advice.asked, 2)}"
    )
    yield f"s = N F/(k r) = {interval(advice.softness, 2)}: {judged(softest)}"
    if rigid is None:
        yield "rigid disks: not measured against bodies so soft"
    else:
        within = "within" if rigid.worst <= advice.asked else "not within"
        yield (
            f"rigid disks: {signed(rigid.mean)} ({signed(rigid.low)} to {signed(rigid.high)}), "
            f"{within} {percent(advice.asked, 2)}"
        )
    if advice.engine:
        yield f"advised: {advice.command} (about {seconds(advice.cpu_seconds)} CPU)"
    elif softest > valid_to(advice.quantity):
        yield "advised: nothing. Fewer people, a smaller push or larger radii make it a crowd"
    else:
        yield "advised: nothing: no method asked about answers for bodies so soft"


def ladder_lines(scene: Scene) -> Iterator[str]:
    """Say of a driven crowd what rigid disks over- or understate at the stiffness of people."""
    bodies, rows = ladder(scene)
    yield "at the stiffness of people, by how much rigid disks are above such bodies:"
    for column, (name, stiffness, soft) in enumerate(bodies, start=1):
        yield f"  {name}, {stiffness} kN/m, s = {soft}:"
        if len({row[column] for row in rows}) == 1:
            yield f"    {rows[0][column]}"
        else:
            yield from (f"    {row[0]}: {row[column]}" for row in rows)
    names = ", ".join(known_bodies())
    yield f"for a run with such bodies: --body, one of {names}"


def write_body_advice(advice: BodyAdvice, folder: Path) -> Path:
    """Write advice.json into the folder, whole or not at all; return its path."""
    content: Mapping[str, object] = {
        "scene": advice.scene.name,
        "quantity": advice.quantity,
        "asked_error": advice.asked,
        "body": dataclasses.asdict(advice.body),
        "softness": list(advice.softness),
        "rigid_over_body": dataclasses.asdict(advice.rigid) if advice.rigid else None,
        "engine": advice.engine or None,
        "command": advice.command or None,
        "cpu_seconds": advice.cpu_seconds if advice.engine else None,
    }
    write_json(folder / "advice.json", content)
    return folder / "advice.json"
