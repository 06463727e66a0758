"""People who keep their distance, and push only with a share of their wish. Computed in nscd/core/drive.cpp."""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
import pydantic

from analysis.scene.fields import IN_ORDER, Count, Number, Positive, Schema
from nscd.arrays import Floats, Indices, Mask

Share = Annotated[Number, pydantic.Field(ge=0, le=1)]
Seed = Annotated[int, pydantic.Strict(), pydantic.Field(ge=0, le=4_000_000_000)]


def _in_order(people: tuple[int, int]) -> tuple[int, int]:
    if people[0] > people[1]:
        raise ValueError(f"{people[0]} to {people[1]}. The first comes first")
    return people


class Some(Schema):
    """Name some people: by their ids, the first and the last."""

    people: Annotated[tuple[Count, Count], pydantic.AfterValidator(_in_order), IN_ORDER]

    def of(self, ids: Indices) -> Mask:
        """Who (n,) of these ids (n,) is named."""
        return (ids >= self.people[0]) & (ids <= self.people[1])

    def shifted(self, by: int) -> Self:
        """Return it for people whose ids are larger by so much."""
        return self.model_copy(update={"people": tuple(who + by for who in self.people)})


class Pusher(Some):
    """Say with which share of their wish some people push.

    people: ids, the first and the last
    push_share: 0 to 1"""

    push_share: Share


class Distance(Schema):
    """Let people keep their distance, and push with a share p of their wish:

    u_d = (1 − p) v n + p U e, turned by an angle that is held for a while, and jostling besides.

    e points along the way, before a door to a place from which it is 45° aslant, and from beside it
    along its line, clear of its posts. n is e − Σ 5 exp(−gap/0.1 m) u over people in the directions
    u, and over walls with 0.05 m, normalised; walls, and people who are no nearer to one's own goal,
    turn nobody back. v = min(U, gap/T) max(0, n·e), with the least gap of who stands before: who is
    nearer to one's own goal and less than 0.8 of both radii beside n. Towards a wall v n is at most
    its gap/T. Two meet where each is before the other and they walk against each
    other: for who comes within 3 m, less than 1 m beside the way, everybody keeps to the right, by
    up to 2 of the way, Σ (1 − gap/3 m) of it. There n·e does not count; who has the shorter way
    left shuffles on as with a gap of 0.2 m, the other waits. Collision-free speed model (Tordeux,
    Chraibi, Seyfried 2016) with the order of ways.

    time_gap_s: s, T; left out, everybody pushes with m U/τ for ever
    push_share: p, 0 to 1; 1 is that push
    pushing_people: share of the people who push so; the others do not push; drawn by the seed
    pushers: shares of some people
    heading_sd_rad: rad, standard deviation of the angle
    heading_hold_s: s, how long it is held, by each person from another instant on
    jostling_m_per_s: m/s, standard deviation of a slow velocity that neighbours share, before doors
    jostling_length_m, jostling_period_s: m, s, over which it changes
    seed: of all that is drawn"""

    time_gap_s: Positive | None = None
    push_share: Share = 1.0
    pushing_people: Share = 1.0
    pushers: tuple[Pusher, ...] = ()
    heading_sd_rad: Annotated[Number, pydantic.Field(ge=0, le=3)] = 0.0
    heading_hold_s: Positive = 0.5
    jostling_m_per_s: Annotated[Number, pydantic.Field(ge=0, le=10)] = 0.0
    jostling_length_m: Positive = 0.9
    jostling_period_s: Positive = 3.0
    seed: Seed = 1

    @pydantic.model_validator(mode="before")
    @classmethod
    def _with_a_gap(cls, value: Any) -> Any:
        """Refuse what needs a time gap where there is none."""
        if isinstance(value, dict) and value.get("time_gap_s") is None:
            for key, field in Distance.model_fields.items():
                if key in value and value[key] != field.default:
                    raise ValueError(
                        f"{key}: only for people who keep their distance. Give time_gap_s"
                    )
        return value

    @property
    def keeps_distance(self) -> bool:
        """Whether people keep their distance."""
        return self.time_gap_s is not None

    @property
    def noisy(self) -> bool:
        """Whether what people want depends on the time."""
        return self.heading_sd_rad > 0 or self.jostling_m_per_s > 0

    def numbers(self) -> Floats:
        """Give the law as the core takes it: (7,)."""
        return np.array(
            [self.time_gap_s or 0.0, self.heading_sd_rad, self.heading_hold_s, self.jostling_m_per_s,
             self.jostling_length_m, self.jostling_period_s, self.seed], dtype=float,
        )  # fmt: skip

    def push_shares(self, ids: Indices) -> Floats:
        """Give p (n,) of people with these ids (n,)."""
        fraction = np.full(len(ids), self.push_share)
        if self.pushing_people < 1:
            fraction[_uniform(self.seed, ids) >= self.pushing_people] = 0.0
        for some in self.pushers:
            fraction[some.of(ids)] = some.push_share
        return fraction


def _uniform(seed: int, ids: Indices) -> Floats:
    """A number (n,) from 0 to 1 of each id (n,): that of a random generator of its own."""
    if not len(ids):
        return np.zeros(0)
    numbers = [np.random.SeedSequence([seed, int(one)]).generate_state(1)[0] for one in ids]
    return np.asarray(numbers) / 4294967296.0
