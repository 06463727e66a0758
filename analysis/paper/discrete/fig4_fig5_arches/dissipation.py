"""The arch under other laws: dissipation k from nothing to far beyond m_eff, and contacts that are
held shut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure

from analysis.compare.statistics import relative_difference
from analysis.pages.drawing import BLACK, BLUE, GREY, ORANGE
from analysis.pages.section import Claim, Picture, Table, Verdict
from analysis.paper.discrete.fig4_fig5_arches.pressed_crowd import Arch, carried_interval
from nscd import ContactLaw, Percussions
from nscd.arrays import Floats

# kg; two people of 75 kg have the effective mass 37.5 kg
DISSIPATIONS = (0.0, 1.0, 3.0, 10.0, 30.0, 37.5, 100.0, 300.0, 1e3, 1e4)
EFFECTIVE_MASS = 37.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Maintained:
    """What the equality W λ = C u⁻ (paper (2), (8)) asks of an arch. Of its shortest solution λ/τ:
    how many contacts are pulling, strongest_N and total_N of the pulls, push_N the largest push;
    spread: least over largest singular value of C M^(-1/2), zeros left out; answer: the percussions
    with `maintained=True`."""

    pulling: int
    strongest_N: float  # noqa: N815  (the unit is newton)
    total_N: float  # noqa: N815
    push_N: float  # noqa: N815
    spread: float
    answer: Percussions

    @classmethod
    def of(cls, arch: Arch) -> Maintained:
        """By singular values of the dense M^(-1/2) Cᵀ, which do not square the condition as W
        does."""
        root = np.sqrt(np.repeat(arch.snapshot.mass, 2))
        matrix = arch.contacts.normal_matrix(len(arch.snapshot)).toarray().T / root[:, None]
        reaction, _, rank, values = np.linalg.lstsq(
            matrix, root * arch.left_velocity.ravel(), rcond=1e-10
        )
        force = reaction / arch.window
        pulls = np.minimum(force, 0.0)
        return cls(
            pulling=int((force < -1e-9 * np.abs(force).max()).sum()),
            strongest_N=float(-pulls.min()),
            total_N=float(-pulls.sum()),
            push_N=float(force.max()),
            spread=float(values[rank - 1] / values[0]),
            answer=arch.under(ContactLaw(maintained=True)),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """The arch under a law: dissipation k (kg), whether it acts across contacts too (the paper's
    single k), the arch with that answer, and the proven interval (N) of Σ λ/τ at the person who
    carries most."""

    dissipation: float
    across: bool
    arch: Arch
    most: int
    lower: float
    upper: float

    @property
    def forces(self) -> Floats:
        """n·p/τ (k,) N."""
        return self.arch.normal_forces()

    @property
    def reactions(self) -> Floats:
        """λ/τ (k,) N."""
        return self.arch.answer.reaction / self.arch.window

    @property
    def energy_share(self) -> float:
        """ΔE/E⁻ of the impact: −1 where all of the left velocity's energy is lost, > 0 where energy
        was gained."""
        mass, left = self.arch.snapshot.mass, self.arch.left_velocity
        return self.arch.answer.energy_change / (0.5 * float(mass @ (left**2).sum(1)))


def dissipation_trials(arch: Arch, dissipations: Sequence[float] = DISSIPATIONS) -> list[Trial]:
    """The arch with each k, along and across the contacts (paper (1)) and along the normals
    only."""
    trials = []
    for across in (True, False):
        for k in dissipations:
            law = ContactLaw(dissipation=k, tangential_dissipation=None if across else 0.0)
            tried = replace(arch, answer=arch.under(law))
            most = tried.largest(tried.carried())
            lower, upper = carried_interval(tried, most)
            trials.append(
                Trial(dissipation=k, across=across, arch=tried, most=most, lower=lower, upper=upper)
            )
    return trials


def maintained_claim(contacts: int, opening: int, pull: Maintained) -> Claim:
    held = opening == 0 and pull.pulling == 0
    return Claim(
        where="2.1, (2), (8)",
        statement="“For a dense crowd, contacts are maintained”: C u⁺ = 0",
        verdict=Verdict.HOLDS
        if held
        else Verdict.PARTLY
        if opening < 0.1 * contacts
        else Verdict.FAILS,
        reason=f"{opening} of {contacts} contacts open when reactions only push. Held shut, {pull.pulling} of them pull, "
        f"with up to {pull.strongest_N / 1e3:.3g} kN.",
    )


def dissipation_claim(trials: Sequence[Trial]) -> Claim:
    paper = [t for t in trials if t.across]
    start = paper[0].arch.carried()
    change = {t.dissipation: relative_difference(start, t.arch.carried()) for t in paper}
    moderate = max(value for k, value in change.items() if k <= EFFECTIVE_MASS)
    strong = max(change.values())
    verdict = (
        Verdict.HOLDS if moderate >= 0.1 else Verdict.PARTLY if strong >= 0.1 else Verdict.FAILS
    )
    at_pair = next(t for t in paper if t.dissipation == EFFECTIVE_MASS).forces.max()
    listed = "; ".join(
        f"{value:.1%} at {k:g} kg"
        for k, value in change.items()
        if k in (10.0, 37.5, 300.0, 1e3, 1e4)
    )
    return Claim(
        where="2.3.1, Fig. 4d",
        statement="“different behavior according to the calibration of the coefficient of dissipation k”",
        verdict=verdict,
        reason=f"The sums of magnitudes change from those at k = 0 by {listed} (rms). Up to k = m_eff = {EFFECTIVE_MASS:g} kg, "
        f"where a pair is still inelastic, the change is at most {moderate:.1%}; the largest force of a contact changes by "
        f"{abs(at_pair / paper[0].forces.max() - 1):.1%} there.",
    )


def trial_warnings(trials: Sequence[Trial]) -> list[str]:
    out = []
    for trial in trials:
        answer, name = (
            trial.arch.answer,
            f"k = {trial.dissipation:g} kg{'' if trial.across else ', normal only'}",
        )
        if answer.status != "solved":
            out.append(f"{name}: {answer.status}: {answer.reason}")
        out.extend(f"{name}: {warning}" for warning in answer.warnings)
    return out


def dissipation_table(trials: Sequence[Trial]) -> Table:
    rows = []
    for trial in trials:
        force, reaction, answer = trial.forces, trial.reactions, trial.arch.answer
        rows.append(
            (
                "along and across" if trial.across else "along only", trial.dissipation,
                "; ".join([str(answer.status), *answer.warnings]), float(force.mean()), float(np.quantile(force, 0.95)),
                float(force.max()), float(force.min()), float(reaction.mean()), float(reaction.max()),
                float(trial.arch.carried()[trial.most]), float(trial.arch.distance()[trial.most]),
                trial.upper - trial.lower, trial.energy_share,
            )
        )  # fmt: skip
    head = ("k acts", "k (kg)", "status", "n·p/τ: mean (N)", "95 % (N)", "largest (N)", "least (N)", "λ/τ: mean (N)",
            "largest (N)", "largest sum of magnitudes (N)", "its distance (m)", "interval of its Σλ/τ (N)",
            "ΔE / E⁻")  # fmt: skip
    return Table(
        caption="Influence of the dissipation k, the same arch. A negative least n·p/τ is a pull: dissipation at contacts that "
        "open. Interval: how far mechanics leaves Σλ/τ open at the person with the largest sum. E⁻: the kinetic energy before.",
        head=head,
        rows=rows,
    )


def dissipation_picture(trials: Sequence[Trial]) -> Picture:
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    axes = figure.subplots(1, 2)
    ticks = [0, 1, 10, 100, 1e3, 1e4]
    for axis, across in zip(axes, (True, False), strict=True):
        chosen = [t for t in trials if t.across == across]
        k = [t.dissipation for t in chosen]
        series = (
            ("largest n·p/τ", [t.forces.max() for t in chosen], "s-", ORANGE),
            ("95 % of n·p/τ", [np.quantile(t.forces, 0.95) for t in chosen], "D-", BLUE),
            ("mean n·p/τ", [t.forces.mean() for t in chosen], "o-", BLACK),
            ("largest λ/τ", [t.reactions.max() for t in chosen], "s--", ORANGE),
            ("mean λ/τ", [t.reactions.mean() for t in chosen], "o--", BLACK),
            ("strongest pull, −n·p/τ", [max(-t.forces.min(), 0.0) for t in chosen], "v:", BLUE),
        )
        for label, values, style, colour in series:
            axis.plot(
                k,
                np.array(values) / 1e3,
                style,
                color=colour,
                mfc="none" if "--" in style else colour,
                ms=5,
                label=label,
            )
        axis.axvline(EFFECTIVE_MASS, color=GREY, lw=1)
        axis.annotate(
            "m_eff",
            (EFFECTIVE_MASS, 0.5),
            xycoords=("data", "axes fraction"),
            fontsize=8,
            ha="right",
            rotation=90,
        )
        axis.set_xscale("symlog", linthresh=1.0)
        axis.set_xticks(ticks, ["0", "1", "10", "100", "1000", "10000"])
        axis.set(xlabel="dissipation k (kg)", ylabel="force (kN)", xlim=(-0.1, 1.5e4))
        axis.set_title(
            "k along and across the contacts (paper)" if across else "k along the normals only",
            fontsize=10,
        )
        axis.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=8)
    caption = "(d) Normal percussions and reactions, as forces, against the dissipation k; people feel the whole p."
    return Picture(name="fig_4_dissipation", figure=figure, caption=caption)  # fmt: skip
