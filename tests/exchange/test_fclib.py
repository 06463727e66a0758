"""Contact problems as FCLIB files: the layout of its own programs, there and back, and what is
refused."""

import dataclasses
import doctest
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array, csc_array, csr_array

from analysis.percussions import Setting, percussions_of
from analysis.scene import Crowd, read_scene, room
from analysis.studies.exchange.fclib import read_problem, write_problem
from analysis.studies.exchange.problem import is_hdf5
from analysis.support.extras import MissingExtraError
from analysis.support.write_frames import write_frame
from nscd import ContactLaw, Snapshot

h5py = pytest.importorskip("h5py", reason="needs h5py")

ROOT = Path(__file__).resolve().parents[2]
FOREIGN = ROOT.parent / "shared/data/fclib_local_problem_test.hdf5"
MATRICES = {"fclib_global": ("M", "H"), "fclib_local": ("W",)}
VECTORS = {"fclib_global": ("f", "w", "mu"), "fclib_local": ("q", "mu")}


def pressed(friction, people=70):
    """A dense crowd before a door: its percussions at once."""
    scene = room("dense", 4.0, 4.0, 0.8, Crowd(people=people))
    setting = dataclasses.replace(Setting.of(scene), friction=friction, contact_tolerance=0.02)
    return percussions_of(setting, scene.snapshot)


@pytest.fixture(scope="module", params=[0.0, 0.3], ids=["smooth", "friction"])
def written(request, tmp_path_factory):
    """Percussions, and the file that has their problem."""
    found = pressed(request.param)
    path = tmp_path_factory.mktemp("fclib") / "dense.hdf5"
    write_problem(path, found, {"source": "a room"}, local=True)
    return found, path


def matrix_of(group):
    """A matrix as FCLIB's reader takes it, every size and kind as its C code has them."""
    one = {name: group[name] for name in ("nzmax", "m", "n", "nz")}
    for value in one.values():
        assert value.shape == (1,)
        assert value.dtype == np.int32
    nzmax, m, n, nz = (int(value[0]) for value in one.values())
    pointers = {-1: n + 1, -2: m + 1}.get(nz, nz)
    assert group["p"].shape == (pointers,)
    assert group["i"].shape == group["x"].shape == (nzmax,)
    assert group["p"].dtype == group["i"].dtype == np.int32
    assert group["x"].dtype == np.float64
    values, indices, starts = group["x"][()], group["i"][()], group["p"][()]
    if nz >= 0:
        return coo_array((values, (starts, indices)), shape=(m, n)).tocsc()
    assert starts[-1] == nzmax
    return csc_array((csc_array if nz == -1 else csr_array)((values, indices, starts), (m, n)))


def check_layout(path):
    """What fclib.h reads of a file with a problem and its solution: names, kinds and sizes."""
    with h5py.File(path) as file:
        kinds = [name for name in MATRICES if name in file]
        assert kinds
        for kind in kinds:
            group = file[kind]
            space = int(group["spacedim"][0])
            assert group["spacedim"].dtype == np.int32
            assert space in (2, 3)
            found = {name: matrix_of(group[name]) for name in MATRICES[kind]}
            rows, columns = found["M" if "M" in found else "W"].shape
            assert rows == columns
            size = found["H"].shape[1] if "H" in found else rows
            sizes = {"f": rows, "w": size, "q": size, "mu": size // space}
            for name in VECTORS[kind]:
                assert group["vectors"][name].shape == (sizes[name],)
                assert group["vectors"][name].dtype == np.float64
            for text in group["info"].values():
                kind_of = text.id.get_type()
                assert text.shape == ()
                assert kind_of.get_strpad() == h5py.h5t.STR_NULLTERM
        lengths = {"u": size, "r": size}
        if "fclib_global" in file:
            lengths["v"] = int(file["fclib_global/M/n"][0])
        for name, length in lengths.items():
            assert file["solution"][name].shape == (length,)


def test_the_layout_is_that_of_the_library(written):
    check_layout(written[1])


@pytest.mark.skipif(not FOREIGN.exists(), reason="the library's own example is not here")
def test_the_library_s_own_file_passes_the_same_check_and_is_refused_by_name(percussions, tmp_path):
    check_layout(FOREIGN)
    shutil.copyfile(FOREIGN, tmp_path / "boxes.hdf5")
    message = percussions("solve", "boxes.hdf5")
    assert (message.returncode, message.stderr) == (
        1,
        "percussions: boxes.hdf5: /fclib_local/spacedim: 3. Problems in the plane (2) are solved "
        "here\n",
    )


def test_the_solution_obeys_the_library_s_equations(written):
    found, path = written
    with h5py.File(path) as file:
        group, solution = file["fclib_global"], file["solution"]
        mass, transfer = (matrix_of(group[name]) for name in ("M", "H"))
        f, w, mu = (group["vectors"][name][()] for name in ("f", "w", "mu"))
        v, u, r = (solution[name][()] for name in ("v", "u", "r"))
        delassus = matrix_of(file["fclib_local/W"])
        q = file["fclib_local/vectors/q"][()]
    assert np.abs(mass @ v - f - transfer @ r).max() < 1e-9 * np.abs(f).max()
    assert np.abs(transfer.T @ v + w - u).max() < 1e-12
    assert np.abs(delassus @ r + q - u).max() < 1e-10
    un, ut, rn, rt = u[::2], u[1::2], r[::2], r[1::2]
    assert min(un.min(), rn.min()) > -1e-9
    assert np.abs(un * rn).max() < 1e-7
    assert (np.abs(rt) <= mu * rn + 1e-9).all()
    assert np.abs(rt * ut + mu * rn * np.abs(ut)).max() < 1e-7
    assert np.allclose(v.reshape(-1, 3)[:, :2], found.solution.right_velocity)


def test_there_and_back_is_the_same_answer(written, percussions, tmp_path):
    found, path = written
    shutil.copyfile(path, tmp_path / "dense.hdf5")
    message = percussions("solve", "dense.hdf5", "--out", "back.csv")
    assert message.returncode == 0, message.stderr
    assert "largest difference of u from /solution" in message.stdout
    rows = np.genfromtxt(tmp_path / "back.csv", delimiter=",", names=True, dtype=None)
    assert np.allclose(rows["reaction_Ns"], found.solution.reaction)
    assert np.allclose(rows["force_x_N"], found.force[:, 0])
    again = read_problem(path).solve().solution
    assert np.abs(again.right_velocity - found.solution.right_velocity).max() < 1e-12


@pytest.mark.parametrize("left", ["fclib_global", "fclib_local"])
def test_the_problem_of_a_stranger_has_the_same_velocities(written, percussions, tmp_path, left):
    """Without /crowd another solver knows only the matrices."""
    path = tmp_path / "bare.hdf5"
    shutil.copyfile(written[1], path)
    with h5py.File(path, "a") as file:
        del file["crowd"], file["fclib_local" if left == "fclib_global" else "fclib_global"]
        u = file["solution/u"][()]
    message = percussions("solve", "bare.hdf5", "--out", "bare.csv", "--tolerance", "1e-10")
    assert message.returncode == 0, message.stderr
    rows = np.genfromtxt(tmp_path / "bare.csv", delimiter=",", names=True, dtype=None)
    assert np.abs(np.column_stack([rows["u_n"], rows["u_t"]]).ravel() - u).max() < 1e-7


@pytest.mark.parametrize("kind", ["rows", "triplets"])
def test_matrices_come_in_three_ways(written, tmp_path, kind):
    path = tmp_path / "other.hdf5"
    shutil.copyfile(written[1], path)
    same = read_problem(path)
    with h5py.File(path, "a") as file:
        group = file["fclib_global/H"]
        full = matrix_of(group)
        for name in ("p", "i", "x", "nz"):
            del group[name]
        rows, triplets = csr_array(full), coo_array(full)
        if kind == "rows":
            parts = {"p": rows.indptr, "i": rows.indices, "x": rows.data, "nz": [-2]}
        else:
            at = triplets.coords
            parts = {"p": at[0], "i": at[1], "x": triplets.data, "nz": [triplets.nnz]}
        for name, values in parts.items():
            group[name] = np.asarray(values, dtype=float if name == "x" else np.int32)
    assert np.array_equal(read_problem(path).contacts.normal, same.contacts.normal)


def test_what_is_known_of_the_reactions(written):
    found, path = written
    with h5py.File(path) as file:
        truth = file["truth"]
        normal = matrix_of(file["fclib_global/H"]).toarray()[:, ::2]
        assert int(truth["rank"][0]) == np.linalg.matrix_rank(normal)
        known, r = truth["determined"][()], file["solution/r"][()].reshape(-1, 2)
        ends = [("lower", "upper", 0)]
        if found.solution.friction is not None:
            ends.append(("friction_lower", "friction_upper", 1))
        for low, high, column in ends:
            low, high = (np.nan_to_num(truth[name][()], nan=np.inf * (-1) ** (name == low))
                         for name in (low, high))  # fmt: skip
            assert (low - 1e-6 <= r[:, column]).all()
            assert (r[:, column] <= high + 1e-6).all()
            assert np.allclose(low[known == 1], high[known == 1])
        assert set(known) <= {0, 1}
        assert file["crowd/dt"].attrs["unit"] == "s"
        assert file["crowd/dt"][0] == found.window
        assert file["crowd"].attrs["source"] == "a room"
        bounds = truth["lower"][()], np.nan_to_num(truth["upper"][()], nan=np.inf)
    write_problem(path.with_name("mean.hdf5"), found, {}, indeterminacy="ensemble")
    with h5py.File(path.with_name("mean.hdf5")) as file:
        truth = file["truth"]
        mean, sd = truth["mean"][()], truth["sd"][()]
        assert truth.attrs["sampling"] == "converged"
        assert (bounds[0] - 1e-6 <= mean).all()
        assert (mean <= bounds[1] + 1e-6).all()
        assert ((sd < 1e-6) >= (known == 1)).all()
        assert "lower" not in truth


def test_a_run_a_dump_and_a_scene_by_command(percussions, tmp_path):
    made = percussions("export", "four_disks", "--fclib", "four.hdf5", "--friction", 0.2)
    assert made.returncode == 0, made.stderr
    assert "FCLIB has inelastic contacts" in made.stderr
    scene = read_scene("four_disks")
    found = percussions_of(Setting.of(scene), scene.snapshot, ContactLaw(friction=0.2))
    again = read_problem(tmp_path / "four.hdf5").solve().solution
    assert np.abs(again.right_velocity - found.solution.right_velocity).max() < 1e-12
    disks = scene.snapshot
    names = ["id", "x", "y", "radius", "mass", "vx", "vy"]
    columns = [disks.ids, *disks.position.T, disks.radius, disks.mass, *disks.velocity.T]
    with (tmp_path / "some.dump").open("w") as file:
        for step, sign in ((0, 1.0), (7, -1.0)):
            turned = [*columns[:5], sign * columns[5], sign * columns[6]]
            write_frame(file, "ATOMS", step, names, turned)
    for words, way in ((["--frame", 0], 1.0), ([], -1.0)):
        made = percussions("export", "some.dump", "--fclib", "d.hdf5", *words)
        assert made.returncode == 0, made.stderr
        left = read_problem(tmp_path / "d.hdf5").left_velocity
        assert np.array_equal(left, way * disks.velocity)
    message = percussions("export", "some.dump", "--fclib", "e.hdf5", "--frame", 2)
    assert message.stderr == "percussions: --frame: 2 where some.dump has 2, from 0\n"
    message = percussions("export", "pair", "--fclib", "e.hdf5", "--frame", 2)
    assert message.stderr == "percussions: --frame: only of a run or a dump, and pair is a scene\n"
    assert not (tmp_path / "e.hdf5").exists()


def test_problems_that_the_library_cannot_say(tmp_path):
    alone = Snapshot(position=[[0, 0]], velocity=[[1, 0]], radius=[0.2], mass=[75])
    with pytest.raises(ValueError, match=r"x\.hdf5: no contact. FCLIB has no problem without"):
        write_problem(tmp_path / "x.hdf5", percussions_of(Setting(), alone), {})
    scene = read_scene("pair")
    found = percussions_of(scene, scene.snapshot, ContactLaw(restitution=0.5))
    with pytest.raises(ValueError, match=r"contacts with restitution\. FCLIB has inelastic ones"):
        write_problem(tmp_path / "x.hdf5", found, {})
    assert not list(tmp_path.iterdir())


def replaced(name, change):
    """A change of a file: a dataset with other content."""

    def apply(file):
        values, attributes = file[name][()], dict(file[name].attrs)
        del file[name]
        file[name] = change(values)
        file[name].attrs.update(attributes)

    return apply


def first(value):
    return lambda values: np.concatenate([[value], values[1:]]).astype(values.dtype)


DAMAGE = {
    "no_problem": (lambda file: file.__delitem__("fclib_global"), "/fclib_global: missing, and"),
    "in_space": (replaced("fclib_global/spacedim", first(3)), "/fclib_global/spacedim: 3. Problems"),
    "no_matrix": (lambda f: f.__delitem__("fclib_global/H"), "/fclib_global/H: missing group"),
    "no_vector": (lambda f: f.__delitem__("fclib_global/vectors/f"), "/fclib_global/vectors/f: miss"),
    "size": (replaced("fclib_global/vectors/mu", lambda v: v[1:]), "/fclib_global/vectors/mu: numbers"),
    "rows": (replaced("fclib_global/H/m", first(3)), "/fclib_global/H/m: 3 where 210 is needed"),
    "nan": (replaced("fclib_global/vectors/f", first(np.nan)), "/fclib_global/vectors/f: entry 1: nan"),
    "huge": (replaced("crowd/bodies/left_velocity", lambda v: v + 1e308), "/crowd/bodies/left_velocity: entry"),
    "index": (replaced("fclib_global/H/i", first(10**6)), "/fclib_global/H/i: an index outside of"),
    "starts": (replaced("fclib_global/H/p", lambda v: v[::-1]), "/fclib_global/H/p: from 0 to at most"),
    "friction": (replaced("fclib_global/vectors/mu", first(-1)), "/fclib_global/vectors/mu: -1. Coef"),
    "text": (replaced("fclib_global/vectors/f", lambda v: "f"), "/fclib_global/vectors/f: numbers"),
    "equality": (lambda file: file.create_group("fclib_global/G"), "/fclib_global/G: equality"),
    "other": (replaced("fclib_global/vectors/f", lambda v: 2 * v), "/fclib_global/vectors/f: not what"),
    "unit": (lambda f: f["crowd/dt"].attrs.update(unit="ms"), "/crowd/dt: unit 'ms' where 's' is"),
    "version": (lambda f: f["crowd"].attrs.update(version=9), "/crowd/version: 9. Version 1 is read"),
    "body": (replaced("crowd/bodies/mass", first(-1.0)), "/crowd/: mass: -1 in row 0"),
    "bodies": (replaced("crowd/bodies/mass", lambda v: v[1:]), "/crowd/bodies/mass: numbers of shape"),
    "moved": (replaced("crowd/bodies/position", lambda v: 1.1 * v), "/crowd/contacts: number 1: its normal"),
    "gaps": (replaced("crowd/contacts/gap", lambda v: v + 1e-3), "/crowd/contacts: number 1: its normal"),
    "walls": (replaced("crowd/walls/end", lambda v: v + 0.1), "/crowd/contacts: number "),
    "solution": (replaced("solution/u", lambda v: v[2:]), "/solution/u: "),
    "odd": (replaced("solution/u", lambda v: v[1:]), "/solution/u: "),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_one_line(refused, tmp_path, pressed_file, damage):
    change, says = DAMAGE[damage]
    shutil.copyfile(pressed_file, tmp_path / "bad.hdf5")
    with h5py.File(tmp_path / "bad.hdf5", "a") as file:
        change(file)
    assert refused("solve", "bad.hdf5").startswith(f"percussions: bad.hdf5: {says}")


@pytest.fixture(scope="module")
def pressed_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "whole.hdf5"
    write_problem(path, pressed(0.0), {}, indeterminacy="none")
    return path


def test_a_file_that_breaks_off(refused, tmp_path, pressed_file):
    (tmp_path / "cut.hdf5").write_bytes(pressed_file.read_bytes()[:3000])
    assert refused("solve", "cut.hdf5").startswith("percussions: cut.hdf5: damaged: ")


def test_options_of_dumps_have_no_place(percussions, pressed_file):
    message = percussions("solve", pressed_file, "--left-velocity", "dump")
    assert message.stderr.startswith("percussions: --left-velocity: ")
    assert message.stderr.endswith("has its own. This option is for dumps\n")


def test_a_missing_library_is_named_with_its_extra(monkeypatch, pressed_file):
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(MissingExtraError, match=r"h5py is not installed\. .*\[exchange\]"):
        read_problem(pressed_file)


def test_python_of_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = str(ROOT / "docs/how_to/exchange.md")
    done = doctest.testfile(page, module_relative=False)
    assert (done.failed, done.attempted) == (0, 7)


@pytest.mark.parametrize("start", [b"BZh91AY&SY", b"\x1f\x8b\x08\0\0\0\0\0\0\xff\xff\xff"])
def test_what_begins_as_compressed_and_is_not_is_no_problem_of_contacts(tmp_path, start):
    path = tmp_path / "bad.dump"
    path.write_bytes(start)
    assert not is_hdf5(path)
