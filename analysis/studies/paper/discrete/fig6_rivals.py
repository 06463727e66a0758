"""Fig. 6 and 2.3: percussions against first-order model, social force and Löhner's law."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from analysis.compare.comparison import correlation, relative_difference
from analysis.dumps import DumpError
from analysis.engines import PENALTY, EngineError
from analysis.engines.run import EngineRun
from analysis.pages import drawing
from analysis.pages.section import Cell, Claim, Section, Verdict
from analysis.pages.words import Words
from analysis.scene.real.separate import OverlapError
from analysis.scene.scene import Scene, read_scene
from analysis.studies.paper.discrete import rival_forces as forces
from analysis.studies.paper.discrete.engine_runs import installed_engine
from analysis.studies.paper.discrete.pressed_crowd import RING_M, blocked, blocked_runs
from analysis.support.parallel import Progress
from nscd.arrays import Floats
from nscd.rivals import LoehnerReading, SocialForceLaw
from nscd.show import contact_lines

ROUNDING = 1e-6
# An overlap below this share of a diameter is not seen in a picture.
SEEN = 0.01
NOTICEABLE, LARGE = 0.01, 0.1
LAW = SocialForceLaw()


def special_case(words: Words, equal: forces.Chain) -> Claim:
    """Judge whether (4) is the percussions where all masses are equal."""
    special = relative_difference(equal["percussion"], equal["first_order"])
    return words.claim("special_case", Verdict.of(special < ROUNDING), special=special)


def constant_in_a_chain(words: Words, equal: forces.Chain, unequal: forces.Chain) -> Claim:
    """Judge whether the social force is constant along a chain: touching, and at rest."""
    both = (equal, unequal)
    in_contact = max(float(np.abs(chain["social"] / LAW.strength - 1).max()) for chain in both)
    rest = equal["social_at_rest"]
    verdict = Verdict.of(in_contact < ROUNDING, bool(np.ptp(rest) / LAW.strength < LARGE))
    return words.claim("constant_in_a_chain", verdict, touching=in_contact, rest=rest)


def restrictive_mass(
    words: Words, unequal: forces.Chain, arches: Sequence[forces.ArchForces]
) -> Claim:
    """Judge whether equal masses restrict the first-order model: it counts as holding where every
    difference is large, in part where one is noticeable; arches: of equal and of unequal masses."""
    parts = [relative_difference(unequal["percussion"], unequal["first_order"])]
    for arch in arches[1:]:
        laws = (arch.by_law[law] for law in (forces.PERCUSSIONS, forces.FIRST_ORDER))
        contact, _, carried, resultant = forces.differences(*laws)
        parts += [contact, carried, resultant]
    minimum, maximum = min(parts), max(parts)
    verdict = Verdict.of(maximum > NOTICEABLE, minimum > LARGE)
    return words.claim("restrictive_mass", verdict, least=minimum, most=maximum)


def complete_congestion(words: Words, found: Sequence[forces.Congestion]) -> Claim:
    """Judge whether equal masses are why the first-order model stops everybody: it does on the
    blocked crowds, and percussions of unequal masses let somebody go."""
    congests = sum(one.congests for one in found)
    draws, released = sum(len(one.unequal) for one in found), sum(one.released for one in found)
    verdict = Verdict.of(congests == len(found), 2 * released >= draws)
    counts = {"congests": congests, "draws": draws, "freed": released}
    return words.claim("complete_congestion", verdict, found=found, **counts)


def constant_without_overlap(
    words: Words, arch: forces.ArchForces, difference: forces.WithoutOverlap
) -> Claim:
    """Judge whether the social force is constant in a crowd without overlaps, `difference`."""
    spread = float(np.ptp(difference.contact)) / LAW.strength
    uneven = float(difference.carried.std() / difference.carried.mean())
    thinner = 1 - float(difference.carried_apart.mean() / difference.carried.mean())
    constant = max(spread, difference.friction / LAW.strength) < ROUNDING
    sizes = {"spread": spread, "uneven": uneven, "thinner": thinner}
    verdict = Verdict.of(constant, max(uneven, thinner) < LARGE)
    return words.claim("constant_without_overlap", verdict, crowd=arch.scene.name, **sizes)


def no_overlap(words: Words, evacuated: Sequence[forces.Evacuation]) -> Claim:
    """Judge whether nobody overlaps in the evacuation by the social force model, at each desired
    speed: true where the deepest overlap of half of the looks at least is SEEN of a diameter or
    less."""
    found: list[dict[str, Any]] = []
    for speed in sorted({one.speed for one in evacuated}):
        deepest = np.concatenate([one.deepest for one in evacuated if one.speed == speed])
        found.append({"speed": speed, "median": np.median(deepest)})
    clear = [each["median"] <= SEEN * forces.DIAMETER_M for each in found]
    verdict = Verdict.of(all(clear), any(clear))
    return words.claim("no_overlap", verdict, found=found)


def unrealistic(words: Words, arch: forces.ArchForces) -> Claim:
    """Judge whether the social force is blind to how the crowd presses."""
    reference, social = arch.by_law[forces.PERCUSSIONS], arch.by_law[forces.SOCIAL]
    value = correlation(reference.contact, social.contact)
    verdict = Verdict.of(value < 0.5, social.spread < 0.5 * reference.spread)
    both = {"social": social, "reference": reference}
    return words.claim("unrealistic", verdict, crowd=arch.scene.name, value=value, **both)


def surface(words: Words, overlap: float, radii: tuple[float, float], ratio: float) -> Claim:
    """Judge whether (9) sees the size of a contact: `ratio` of its forces at the same overlap (m)
    for disks of two radii (m)."""
    half = 0.5 * overlap
    chords = [2e3 * float(np.sqrt(2 * radius * half - half**2)) for radius in radii]
    verdict = Verdict.of(abs(ratio - 1) < ROUNDING, abs(chords[1] / chords[0] - 1) > NOTICEABLE)
    sizes = {"overlap": 1e3 * overlap, "radii": radii, "ratio": ratio, "chords": chords}
    return words.claim("surface", verdict, **sizes)


def non_zero_apart(words: Words, beyond: Mapping[str, float]) -> Claim:
    """Judge whether (10) acts without a contact, by `loehner_beyond_touch`."""
    printed, text = beyond[forces.PRINTED], beyond[forces.TEXT]
    verdict = Verdict.of(printed > 0, text > 0)
    return words.claim("non_zero_apart", verdict, printed=printed, text=text)


OF_A_PAIR = (
    ("social", "social force (9)", drawing.BLUE, "-", "s"),
    ("repulsion", "its repulsion alone", drawing.GREEN, "--", "x"),
    (LoehnerReading.TEXT, "Löhner (10), cases exchanged", drawing.PINK, "-.", "D"),
    (LoehnerReading.PRINTED, "Löhner (10), as printed", drawing.PINK, ":", "v"),
)
OF_A_CHAIN = (
    ("percussion", "percussions p/τ", drawing.BLACK, "o", "-", 9),
    ("first_order", "first-order model, λ m̄/τ", drawing.ORANGE, "^", "--", 5),
    ("social_at_rest", "social force, at rest under the drive", drawing.GREEN, "x", ":", 7),
    ("social", "social force, touching chain", drawing.BLUE, "s", "-", 5),
    ("loehner_text", "Löhner, cases exchanged", drawing.PINK, "D", "-.", 5),
    ("loehner_printed", "Löhner, as printed", drawing.PINK, "v", ":", 5),
)
HOLLOW = ("percussion", "loehner_printed")
# Rings with fewer contacts have no mean.
LEAST_CONTACTS = 10


def draw_laws(limit: float) -> Figure:
    """Draw the force of one pair against its gap, by law; limit: N, f_max."""
    gap = np.concatenate([np.linspace(-0.02, 0.0, 21), np.linspace(1e-6, 0.5, 200)])
    of_pairs = forces.pair_forces(gap, forces.RADIUS_M, limit)
    figure, (axes,) = drawing.panels(8.0, 4.4, grid="both")
    label = "percussions: any force at touch, none beyond"
    axes.axvline(0.0, color=drawing.BLACK, lw=4, alpha=0.25, label=label)
    touch = int((gap <= 0).sum())
    for name, label, colour, line, marker in OF_A_PAIR:
        style: dict[str, Any] = {"ls": line, "color": colour, "marker": marker, "markevery": 20}
        style |= {"ms": 5, "mfc": "none"}
        # in two pieces, so that no line joins the two sides of the jump
        axes.plot(1e3 * gap[touch:], of_pairs[name][touch:], label=label, **style)
        axes.plot(1e3 * gap[:touch], of_pairs[name][:touch], **style)
    strength = SocialForceLaw().strength
    anchor, arrow = (30.0, 1.6 * strength), {"arrowstyle": "->"}
    axes.annotate(f"A = {strength:g} N", (0.0, strength), anchor, arrowprops=arrow, fontsize=9)
    x, y = "gap (mm), negative: overlap", "force of a pair (N)"
    drawing.label(axes, x, y, log="y", legend="upper right", size=9)
    return figure


def draw_chains(equal: forces.Chain, unequal: forces.Chain) -> Figure:
    """Draw the force along the chain for equal and unequal masses, and what the first-order model
    misjudges."""
    figure, (left, middle, right) = drawing.panels(12.5, 4.8, 1, 3, grid="both")
    middle.sharey(left)
    for axes, chain in ((left, equal), (middle, unequal)):
        contact, mass = np.arange(1, len(chain["percussion"]) + 1), chain["mass"]
        for name, label, colour, marker, style, size in OF_A_CHAIN:
            face = "none" if name in HOLLOW else colour
            drawn: dict[str, Any] = {"ls": style, "color": colour, "ms": size, "mfc": face}
            axes.plot(contact, chain[name], marker, lw=1.2, label=label, **drawn)
        masses = f"{mass.min():g} to {mass.max():g} kg" if np.ptp(mass) else f"{mass[0]:g} kg each"
        words = f"contact (1: free end, {len(contact)}: wall)"
        drawing.label(axes, words, title=f"Masses: {masses}", log="y", xticks=contact)
    drawing.label(left, y="normal force (N)")
    _draw_misjudged(right, equal, unequal)
    drawing.legend_below(figure, left, 3, 9)
    return figure


def _draw_misjudged(axes: Axes, equal: forces.Chain, unequal: forces.Chain) -> None:
    for chain, marker, style, colour, label in (
        (equal, "o", "--", drawing.BLACK, "equal masses"),
        (unequal, "^", "-", drawing.ORANGE, "unequal masses"),
    ):
        fraction = 100 * (chain["first_order"] / chain["percussion"] - 1)
        contact = np.arange(1, len(fraction) + 1)
        axes.plot(contact, fraction, marker, ls=style, color=colour, label=label)
        axes.set_xticks(contact)
    y, title = "first-order model above percussions (%)", "First-order model, λ m̄/τ"
    drawing.label(axes, "contact", y, title, legend="best", size=9)


def draw_arches(equal: forces.ArchForces, unequal: forces.ArchForces) -> Figure:
    """Draw the distribution of the force, the force against the distance from the door, and social
    force and first-order model against percussions."""
    figure, every = drawing.panels(10.5, 8.6, 2, 2, grid="major")
    by_force, by_distance, social, first_order = every
    styles = {
        forces.PERCUSSIONS: (drawing.BLACK, "-", "o", 2.4),
        equal.engine: (drawing.GREY, "-", "P", 2.4),
        forces.SOCIAL: (drawing.BLUE, "--", "s", 1.6),
        forces.TEXT: (drawing.PINK, "-.", "D", 1.6),
        forces.PRINTED: (drawing.PINK, ":", "v", 1.6),
    }
    for name, (colour, style, marker, width) in styles.items():
        force = np.sort(equal.by_law[name].contact)
        fraction = 1 - np.arange(len(force)) / len(force)
        by_force.step(force, fraction, style, color=colour, lw=width, where="post")
        middle, mean = _rings(equal, equal.by_law[name].contact)
        drawn: dict[str, Any] = {"ls": style, "color": colour, "lw": width, "ms": 5}
        by_distance.plot(middle, mean, marker, label=name, **drawn)
    x, y, title = "normal force f (N)", "share of contacts beyond f", f"{equal.scene.name}: distribution"
    drawing.label(by_force, x, y, title, log="x", xlim=(10, None))
    x, y = "distance from the middle of the door (m)", f"mean normal force, rings of {RING_M:g} m (N)"
    drawing.label(by_distance, x, y, f"{equal.scene.name}: force against distance", log="y")
    _scatter(social, equal, forces.SOCIAL, "s", drawing.BLUE)
    _scatter(first_order, unequal, forces.FIRST_ORDER, "^", drawing.ORANGE)
    drawing.legend_below(figure, by_distance, 5, 9)
    return figure


def _rings(arch: forces.ArchForces, force: Floats) -> tuple[Floats, Floats]:
    """Middle radius (m) of rings about the door, and the mean force (N) in each."""
    ring = (arch.distance[arch.inside] / RING_M).astype(np.int64)
    count = np.bincount(ring)
    enough = count >= LEAST_CONTACTS
    total = np.bincount(ring, force[arch.inside])[enough]
    middle = (np.flatnonzero(enough) + 0.5) * RING_M
    return np.asarray(middle, dtype=np.float64), np.asarray(total / count[enough])


def _scatter(axes: Axes, arch: forces.ArchForces, name: str, marker: str, colour: str) -> None:
    reference, force = (arch.by_law[law].contact / 1e3 for law in (forces.PERCUSSIONS, name))
    top = 1.05 * max(float(reference.max()), float(force.max()))
    axes.plot([0, top], [0, top], color=drawing.BLACK, lw=0.8, label="equal")
    axes.plot(reference, force, marker, ms=3.5, mfc="none", mec=colour, mew=0.8, ls="none")
    law, alike = name.split(" λ")[0], correlation(reference, force)
    title = f"{arch.scene.name}: {law}, correlation {alike:.3f}"
    x, y = f"{forces.PERCUSSIONS} (kN)", f"{name} (kN)"
    drawing.label(axes, x, y, title, legend="lower right", size=9)


def draw_evacuations(found: Sequence[forces.Evacuation]) -> Figure:
    """Draw the crowd before the exit at the last look, a panel for each desired speed, with the
    contacts that overlap."""
    walls, _ = forces.room()
    first = {one.speed: one for one in reversed(found)}
    figure, every = drawing.panels(10.5, 4.6, 1, len(first), sharey=True)
    norm = Normalize(0.0, 1e3 * max(one.deepest.max() for one in found))
    for axes, (speed, one) in zip(every, sorted(first.items()), strict=True):
        pairs, crowd = one.samples[-1].pairs, one.crowd
        drawing.draw_disks(axes, crowd)
        drawing.draw_walls(axes, zip(walls.start, walls.end, strict=True))
        drawing.draw_forces(axes, contact_lines(crowd, pairs), -1e3 * pairs.gap, norm)
        deepest = 1e3 * one.deepest[-1]
        title = f"$u_d$ = {speed:g} m/s: deepest overlap {deepest:.1f} mm"
        axes.set(xlim=(-6.0, 1.5), ylim=(-4.5, 4.5), aspect="equal")
        drawing.label(axes, "x (m)", "" if axes is not every[0] else "y (m)", title)
    drawing.add_scale(figure, every, norm, "overlap of a contact (mm)")
    return figure


LOEHNER_REACH_M = 2.0
CROWDS, CHAINS = ("arch", "arch_masses"), ("chain_wall", "chain_wall_masses")
OVERLAP_M, RADII_M = 0.01, (0.18, 0.3)


def engine_runs(runs: Path) -> list[EngineRun]:
    """List the crowds of equal and of unequal masses by the first engine that is there."""
    engine = installed_engine()
    if engine is None:
        return []
    return [*(EngineRun.of(read_scene(name), engine, runs) for name in CROWDS), *blocked_runs(runs)]


def build(runs: Path, progress: Progress | None = None) -> Section:
    """Build the section: the laws side by side on chains pressed to a wall and on the crowds of
    `arch` and `arch_masses`, and the verdicts.

    The crowds are the first engine's that is there; its runs are taken from `runs` where they are
    unchanged. Without an engine the section has the chains only, and a warning."""
    tell: Progress = progress or (lambda label, fraction: None)
    tell("rivals", 0.0)
    scenes = [read_scene(name) for name in CROWDS]
    drive = scenes[0].drive
    assert drive is not None
    both = [forces.chain_forces(read_scene(name), drive.relaxation_time_s) for name in CHAINS]
    (equal, unequal), warnings = (
        (one for one, _ in both),
        [line for _, message in both for line in message],
    )
    limit = drive.push(forces.MASS_KG)
    named = {name: value for name, value in vars(forces).items() if name.isupper()}
    words = Words(__name__, drive=drive, limit=limit, radius=forces.RADIUS_M, **named)
    arches = _arches(scenes, runs, tell, warnings)
    pictures = {"fig_6_laws": draw_laws(limit), "fig_6_chain": draw_chains(equal, unequal)}
    tables = [
        words.table("table_pair", forces.pair_rows(limit)),
        words.table("table_chain", forces.chain_rows(equal), chain=equal),
        words.table("table_chain", forces.chain_rows(unequal), chain=unequal),
    ]
    judged = [
        special_case(words, equal),
        restrictive_mass(words, unequal, arches),
        constant_in_a_chain(words, equal, unequal),
        surface(words, OVERLAP_M, RADII_M, forces.ratio_of_sizes(OVERLAP_M, RADII_M)),
    ]
    if arches:
        pictures["fig_6_arch"] = draw_arches(*arches)
        tables.append(words.table("table_arch", forces.arch_rows(arches)))
        tell("rivals", 0.7)
        crowds = blocked(runs, warnings, tell)
        if stopped := [forces.congestion_of(crowd) for crowd in crowds if crowd.still]:
            rows = [(*one[:4], max(one.unequal), one.released) for one in stopped]
            tables.append(words.table("table_congestion", rows))
            judged.insert(2, complete_congestion(words, stopped))
        judged += _crowd_claims(words, arches, warnings)
    evacuated = forces.evacuations(tell)
    pictures["fig_6_evacuation"] = draw_evacuations(evacuated)
    tables.append(words.table("table_evacuation", _evacuation_rows(evacuated)))
    judged.append(no_overlap(words, evacuated))
    tables.append(words.table("table_misjudged", _misjudged((equal, unequal), arches)))
    tell("rivals", 1.0)
    return words.section("6", pictures=pictures, tables=tables, claims=judged, warnings=warnings)


def _arches(
    scenes: Sequence[Scene], runs: Path, tell: Progress, warnings: list[str]
) -> list[forces.ArchForces]:
    for engine in PENALTY:
        found = []
        try:
            for number, scene in enumerate(scenes):
                tell("rivals", 0.1 + 0.3 * number)
                run = EngineRun.of(scene, engine.NAME, runs)
                run.record(tell)
                found.append(forces.ArchForces(scene, run.folder))
        except (EngineError, DumpError) as error:
            warnings.append(f"{engine.NAME}: {error}")
            continue
        warnings += [words for arch in found for words in arch.warnings]
        return found
    warnings.append("no engine made a pressed crowd: the laws are compared on chains only")
    return []


def _crowd_claims(
    words: Words, arches: Sequence[forces.ArchForces], warnings: list[str]
) -> list[Claim]:
    equal, unequal = arches
    beyond = forces.loehner_beyond_touch(unequal, LOEHNER_REACH_M)
    found = [unrealistic(words, equal), non_zero_apart(words, beyond)]
    try:
        return [constant_without_overlap(words, equal, forces.WithoutOverlap(equal)), *found]
    except OverlapError as error:
        warnings.append(f"{equal.scene.name} without overlaps: {error}")
        return found


def _misjudged(
    chains: Sequence[forces.Chain], arches: Sequence[forces.ArchForces]
) -> list[Sequence[Cell]]:
    """What the first-order model makes of unequal masses."""
    rows: list[Sequence[Cell]] = []
    for name, chain in zip(CHAINS, chains, strict=True):
        before = (np.append(0.0, chain[law]) for law in ("percussion", "first_order"))
        a, b = (forces.Forces(f[1:], f[1:] + f[:-1], np.diff(f)) for f in before)
        rows.append((name, *forces.differences(a, b), "all at rest", 0))
    for arch in arches:
        a, b = (arch.by_law[law] for law in (forces.PERCUSSIONS, forces.FIRST_ORDER))
        found = forces.differences(a, b)
        rows.append((arch.scene.name, *found, arch.speed_difference, arch.undetermined))
    return rows


def _evacuation_rows(evacuated: Sequence[forces.Evacuation]) -> list[tuple[float, ...]]:
    rows = []
    for one in evacuated:
        deepest, contacts = 1e3 * one.deepest, len(one.forces)
        sizes = np.mean(deepest > 0), np.median(deepest), deepest.max()
        force = float(one.forces.max()) if contacts else float("nan")
        counts = one.left, contacts / len(one.samples)
        rows.append((one.speed, one.seed, *counts, *map(float, sizes), force))
    return rows
