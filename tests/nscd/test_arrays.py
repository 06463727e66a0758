"""Arrays of other libraries are right or refused, by the name of the field, and stay as they were checked."""

import copy
import pickle
from dataclasses import fields
from fractions import Fraction

import numpy as np
import pytest

from nscd import ContactLaw, Contacts, Snapshot, Walls, find_contacts, solve
from nscd.continuum.medium import Medium
from nscd.stepping import Arms, Motion, Push
from nscd.stress import Kernel

pandas = pytest.importorskip("pandas")
PLACES = [[0.0, 0.0], [0.5, 0.0]]
GIVEN = {"position": PLACES, "radius": [0.25, 0.25], "mass": [75, 75]}


class WithUnit(np.ndarray):  # as astropy and unyt have it
    unit = "km / h"


class Bare(WithUnit):
    unit = ""


class Packed:  # as pint has it: no array, with one inside
    units, magnitude = "dimensionless", [0.25, 0.5]


class Graph:  # as a tensor of torch that knows its gradient
    def __array__(self, *_, **__):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.")


SIZES = np.array([0.25, 0.5])
TABLE = pandas.DataFrame({"unit": [0.25, 0.5], "mask": [1, 2]}).convert_dtypes()


@pytest.mark.parametrize(
    "value",
    [
        *(SIZES.astype(kind) for kind in ("f2", "f4", ">f8", "g", object)),
        SIZES[::-1][::-1], SIZES.view(Bare), Packed(),
        np.ma.array(SIZES, mask=[False, False]), np.array([Fraction(1, 4), 0.5], dtype=object),
        TABLE.unit, TABLE.convert_dtypes(dtype_backend="pyarrow").unit, pandas.array([0.25, 0.5], "Float64"),
    ],
    ids=lambda value: f"{type(value).__name__}-{getattr(value, 'dtype', '')}",
)  # fmt: skip
def test_numbers_of_any_kind_are_taken(value):
    assert Snapshot(**GIVEN | {"radius": value}).radius.tolist() == [0.25, 0.5]
    assert Snapshot(**GIVEN | {"position": TABLE}).position.tolist() == [[0.25, 1.0], [0.5, 2.0]]


MASKED = np.ma.masked_values([0.25, -999.0], -999.0)


@pytest.mark.parametrize(
    ("field", "value", "why"),
    [
        ("radius", MASKED, "masked in row 1"),
        ("position", [np.ma.array([0.0, 0.0]), np.ma.array([9.0, 9.0], mask=[True, False])], "masked in row 1"),
        ("radius", [0.25, np.ma.masked], "masked in row 1"),
        ("time", np.ma.masked, "masked"),
        ("radius", SIZES.view(WithUnit), "unit km / h. Give plain numbers in SI units"),
        ("mass", [SIZES[:1].view(WithUnit)[0:1], 75], "unit km / h"),
        ("mass", np.array([Fraction(1, 4), SIZES.view(WithUnit)], dtype=object), "unit km / h"),
        ("time", np.array(1.0).view(WithUnit), "unit km / h"),
        ("radius", pandas.Series([0.25, None], dtype=object), "missing in row 1"),
        ("radius", np.array([0.25, pandas.NA]), "missing in row 1"),
        ("ids", pandas.Series([1, None], dtype="Int64"), "in row 1|missing in row 1"),
        ("radius", [True, True], r"\(bool\)"),
        ("radius", np.array([0.25, True], dtype=object), r"\(object\)"),
        ("time", True, "True. A finite number"),
        ("radius", np.array([(0.25,), (0.5,)], dtype=[("r", float)]), "no array of numbers"),
        ("radius", Graph(), "no array of numbers"),
        ("time", Graph(), "A finite number"),
        ("ids", np.array([2**63 + 5, 1], dtype=np.uint64), "9223372036854775813 in row 0"),
        ("ids", [2.0**63, 1], "9.22337.*in row 0"),
        ("ids", [1, 2.5], "2.5 in row 1"),
    ],
)  # fmt: skip
def test_what_is_no_plain_number_is_refused(field, value, why):
    with pytest.raises(ValueError, match=f"^{field}: .*({why})"):
        Snapshot(**GIVEN | {field: value})


SCALARS = {
    "tolerance": lambda one: find_contacts(Snapshot(**GIVEN), tolerance=one),
    "step": lambda one: Motion(Snapshot(**GIVEN), step=one),
    "friction": lambda one: Motion(Snapshot(**GIVEN), step=0.1, friction=one),
    "relaxation_time": lambda one: Push(desired=np.zeros_like, relaxation_time=one),
    "acceleration": lambda one: Push(acceleration=(0.0, one)),
    "arms: reach": lambda one: Push(arms=Arms(one, 100.0)),
    "period_x": lambda one: Walls(start=PLACES, end=[[0, 1], [1, 1]], period_x=(0, one)),
    "restitution": lambda one: ContactLaw(restitution=one),
    "width": lambda one: Kernel(width=one),
    "density": lambda one: Medium(density=one, volume_dissipation=9.0),
}


@pytest.mark.parametrize("name", SCALARS)
def test_scalars_have_no_unit_and_no_mask(name):
    for value in (np.array(0.5).view(WithUnit), np.ma.masked, "0.5", True, 1j):
        with pytest.raises(ValueError, match=f"^{name}: "):
            SCALARS[name](value)


def test_copies_cannot_be_written_to():
    walls = Walls(start=[[-0.25, -1]], end=[[-0.25, 1]])
    two = Snapshot(**GIVEN)
    joined, medium = two.joined([7, 7]), Medium(density=SIZES, volume_dissipation=9.0)
    for one in (
        two,
        joined,
        joined.bodies,
        walls,
        find_contacts(two, walls, tolerance=1e-9),
        medium,
    ):
        for other in (copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
            for field in fields(one):
                mine, its = getattr(one, field.name), getattr(other, field.name)
                if isinstance(mine, np.ndarray):
                    np.testing.assert_array_equal(mine, its)
                    assert (mine.dtype, its.flags.writeable) == (its.dtype, False)
    remade, (kind, values) = two.__reduce__()
    with pytest.raises(ValueError, match=r"^radius: -1 in row 0"):
        remade(kind, values | {"radius": [-1.0, 1.0]})


def test_a_contact_that_is_given_twice_is_refused():
    three = Snapshot(position=[*PLACES, [1.0, 0.0]], radius=[0.25] * 3, mass=[75] * 3)
    # in a corner, so that one disk has two contacts with walls
    walls = Walls(start=[[-0.25, -0.25], [-0.25, -0.25]], end=[[-0.25, 1], [0.1, -0.25]])
    found = find_contacts(three, walls, tolerance=1e-9)
    assert len(found) == 4
    speed = np.array([[-1.0, -1.0], [-1.0, 0.0], [-1.0, 0.0]])
    right = solve(three, found, left_velocity=speed).reaction
    turned = solve(three, found.select([3, 1, 0, 2]), left_velocity=speed).reaction
    np.testing.assert_allclose(turned, right[[3, 1, 0, 2]], atol=1e-9)
    for rows in ([0, 0], [0, 1, 2, 1], [2, 3, 0, 2]):
        words = f"^contacts: row {len(rows) - 1} is .* row {rows.index(rows[-1])} again"
        with pytest.raises(ValueError, match=words):
            solve(three, found.select(rows))
    way = [[1, 0], [-1, 0]]
    both = Contacts(first=[0, 1], second=[1, 0], is_wall=[0, 0], normal=way, gap=[0, 0], point=way)
    with pytest.raises(ValueError, match="row 1 is the contact of row 0 again"):
        solve(three, both)
