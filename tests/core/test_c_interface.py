"""The header nscd.h, for programs in C: the example is compiled, and its numbers are those of `nscd.solve`."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import nscd
from nscd import ContactLaw, Snapshot, Walls, find_contacts, solve

HOME = Path(nscd.__path__[0])
EXAMPLE = HOME.parent / "examples" / "percussions.c"
LIBRARY = next(HOME.glob("libnscd.*"), None)
needs_library = pytest.mark.skipif(LIBRARY is None, reason="the core was compiled elsewhere")


@needs_library
def test_the_example_gives_what_python_gives(tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler")
    program = tmp_path / "percussions"
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", f"-I{HOME / 'core'}", f"-L{HOME}"]
    subprocess.run(
        [compiler, *flags, str(EXAMPLE), "-lnscd", f"-Wl,-rpath,{HOME}", "-o", str(program)],
        check=True,
    )
    output = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    lines = [line.split() for line in output.splitlines()]
    crowd = Snapshot(
        position=[[0.25, 0.0], [0.75, 0.0], [1.2, 0.2]],
        velocity=[[-1.0, 0.0], [-1.0, 0.0], [-1.0, -0.5]],
        radius=[0.25] * 3,
        mass=[75.0, 80.0, 60.0],
    )
    wall = Walls(start=[[0.0, -5.0]], end=[[0.0, 5.0]])
    contacts = find_contacts(crowd, wall, tolerance=0.001)
    assert len(contacts) == 3
    for friction in (0.0, 0.4):
        solution = solve(crowd, contacts, law=ContactLaw(friction=friction))
        mine = [words[1:] for words in lines if float(words[0]) == friction]
        percussions = {(int(a), int(b)): (float(x), float(y)) for a, b, x, y in mine[:3]}
        for i, j, wall, p in zip(
            contacts.first, contacts.second, contacts.is_wall, solution.impulse, strict=True
        ):
            np.testing.assert_allclose(percussions[i, -1 if wall else j], p, atol=1e-6)
        after = [[float(word) for word in words[1:]] for words in mine[3:]]
        np.testing.assert_allclose(after, solution.right_velocity, atol=1e-8)


@pytest.fixture
def library():
    if LIBRARY is None:
        pytest.skip("the core was compiled elsewhere")
    library = ctypes.CDLL(str(LIBRARY))
    library.nscd_new.restype = library.nscd_drive_new.restype = ctypes.c_void_p
    library.nscd_message.restype = ctypes.c_char_p
    library.nscd_velocities.restype = library.nscd_spins.restype = ctypes.POINTER(ctypes.c_double)
    return library


def doubles(*values):
    return (ctypes.c_double * len(values))(*values)


def real(value):
    return ctypes.c_double(value)


def test_dissipation_returns_half_the_speed(library):
    """Two equal masses with restitution 1/2."""
    crowd = ctypes.c_void_p(
        library.nscd_new(
            ctypes.c_size_t(2),
            doubles(0, 0, 0.5, 0),
            doubles(1, 0, 0, 0),
            doubles(0.25, 0.25),
            doubles(75, 75),
        )
    )
    # u⁺ = −e u⁻ relative: p = (1 + e) v m/2 = k (1 − e) v, so that k = m (1 + e)/(2 (1 − e))
    assert library.nscd_dissipation(crowd, real(75 * 1.5 / (2 * 0.5)), real(0.0))
    assert library.nscd_touch(crowd, real(1e-9))
    assert not library.nscd_touch(crowd, real(1e-9))
    assert library.nscd_message() == b"gap: disk 0 with 1 is given already"
    pair = ctypes.c_ssize_t(1), ctypes.c_ssize_t(0), real(0.0), real(0.0)
    assert not library.nscd_contact(crowd, *pair)
    assert library.nscd_message() == b"contact: disk 1 with 0 is given twice"
    assert library.nscd_solve(crowd, real(1e-10))
    np.testing.assert_allclose(library.nscd_velocities(crowd)[:4], [0.25, 0, 0.75, 0], atol=1e-9)
    library.nscd_free(crowd)


def test_what_is_wrong_is_said(library):
    two = ctypes.c_size_t(2)
    anchor, still, round_, heavy = doubles(0, 0, 0.5, 0), doubles(0, 0, 0, 0), [0.25, 0.25], [75, 75]

    def message():
        return library.nscd_message().decode()

    assert not library.nscd_new(two, anchor, still, doubles(0.25, 0.0), doubles(*heavy))
    assert message() == "radius: entry 1 is not a usable number"
    assert not library.nscd_new(
        two, doubles(0, 0, np.nan, 0), still, doubles(*round_), doubles(*heavy)
    )
    assert message() == "position: entry 1 is not a usable number"
    assert not library.nscd_new(ctypes.c_size_t(0), None, None, None, None)
    assert not library.nscd_drive_new(doubles(*[0] * 13), ctypes.c_size_t(13))
    assert message() == "drive: these are not its numbers"
    crowd = ctypes.c_void_p(library.nscd_new(two, anchor, still, doubles(*round_), doubles(*heavy)))
    for first, second, x, words in (
        (0, 2, 1.0, "contact: disk 0 with 2 of 2"),
        (1, 1, 1.0, "contact: disk 1 with 1 of 2"),
        (0, -1, 0.5, "contact: the normal of disk 0 at an obstacle is no unit vector"),
    ):
        at = ctypes.c_ssize_t(first), ctypes.c_ssize_t(second), real(x), real(0.0)
        assert not library.nscd_contact(crowd, *at)
        assert message() == words
    assert not library.nscd_friction(crowd, real(-0.1), None)
    assert not library.nscd_dissipation(crowd, real(np.inf), real(0.0))
    assert not library.nscd_solve(crowd, real(0.0))
    assert message() == "tolerance: between 1e-14 and 1 is needed"
    library.nscd_free(crowd)
