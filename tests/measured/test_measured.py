"""Measured forces: files and what is wrong with them, closed forms, and a twin with known forces."""

import csv

import numpy as np
import pytest

from analysis.studies.measured import models
from analysis.studies.measured.models import EDGE, INNER, distance, equilibrium, open_by
from analysis.studies.measured.packing import BETA_N, ErrorBar, Packing, disks_at, read_packing

from analysis.studies.measured.packing import steps_of, contacts_listed  # isort: skip
from analysis.studies.measured.scores import bands, score
from nscd.indeterminacy.ensemble import ensemble
from tests.measured import twin as twins
from tests.measured.twin import ALPHA, MU, PREFIX, SCALE_N, bare, disks, write_twin

SQUARE = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]])
RING = np.array([0, 1, 2, 0]), np.array([1, 2, 3, 3])
FEW = {"chains": 2, "draws": 60, "most_sweeps": 700}


def square(force=1.0):
    """Four disks in a square that push their neighbours with 1 N."""
    snapshot = disks_at(SQUARE, np.full(4, 20.0))
    contacts, position = contacts_listed(snapshot, *RING)
    visited = np.zeros(len(contacts))
    visited[position] = force
    return Packing(
        name="square", snapshot=snapshot, contacts=contacts, force=visited,
        sides=np.full(len(contacts), 2), error=ErrorBar(0.1, 0.01), least=0.01,
    )  # fmt: skip


def test_loads_press_and_their_virial_is_the_mean_force():
    packing = square()
    assert packing.boundary.all()
    assert packing.loads == pytest.approx(np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]))
    assert packing.scale == pytest.approx(1.0)
    assert packing.unbalanced == pytest.approx(0.0, abs=1e-12)


def test_the_wall_sees_what_nothing_hides():
    """A second row is on the boundary where its edge is near, or where the first has a hole."""
    first = [[0, 0], [160, 0], [200, 0], [280, 0], [400, 0], [0, 300], [400, 300]]
    near, hidden, hole, far = [155, 20], [200, 40], [240, 40], [240, 150]
    at = np.array([*first, near, hidden, hole, far], dtype=float)
    found = bare(at, np.full(len(at), 20.0)).boundary
    assert found.tolist() == [True] * 7 + [True, False, True, False]


def test_the_error_bar_comes_from_both_sides(tmp_path):
    random = np.random.default_rng(3)
    packing = bare(*disks(300, 3))
    force = random.gamma(2, 0.03, len(packing.contacts)) + 0.02
    noise = np.sqrt(2) * np.hypot(ALPHA * force, BETA_N) * random.normal(size=(2, len(force)))
    write(tmp_path, packing, np.maximum(force + noise, 1e-4))
    read = only(tmp_path)
    assert (read.error.alpha, read.error.beta) == pytest.approx((ALPHA, BETA_N), rel=0.25)
    assert not read.error.assumed
    difference = (read.force - force) / read.sigma
    assert np.sqrt((difference**2).mean()) == pytest.approx(1.0, abs=0.1)


def write(folder, packing, sides, step="1"):
    twins.write_disks(folder, step, packing.snapshot.position, packing.snapshot.radius)
    among = packing.contacts
    twins.write_forces(folder, step, len(packing.snapshot), among.first, among.second, sides)


def only(folder, **arguments):
    ((name, files),) = steps_of(folder).items()
    return read_packing(name, *files, **arguments)


def test_one_side_is_read_from_a_list_of_bonds(tmp_path):
    packing = bare(*disks(60, 2))
    among, force = packing.contacts, np.linspace(0.02, 0.1, len(packing.contacts))
    rows = zip(among.second, among.first, force, strict=True)
    text = "".join(f"{i} {j} 0 0 {float(f)!r}\n" for i, j, f in rows)
    (tmp_path / f"{PREFIX.format(7)}bonds.txt").write_text(text)
    at = np.column_stack([packing.snapshot.position, packing.snapshot.radius])
    np.savetxt(tmp_path / f"{PREFIX.format(7)}coordinates.txt", at)
    read = only(tmp_path)
    assert read.name == "DSC7"
    assert read.error.assumed
    assert read.force == pytest.approx(force)
    assert read.sigma == pytest.approx(np.sqrt(2) * np.hypot(ALPHA * force, BETA_N))
    assert only(tmp_path, error=ErrorBar(0.0, 0.5)).sigma == pytest.approx(np.sqrt(0.5))


def edited(change):
    def edit(_, disks_file, matrix):
        tables = {file: [line.split(",") for line in file.read_text().splitlines()]
                  for file in (matrix, disks_file)}  # fmt: skip
        change(*tables.values())
        for file, rows in tables.items():
            file.write_text("\n".join(",".join(row) for row in rows) + "\n")

    return edit


def set_cell(row, column, value, table=0):
    return edited(lambda *tables: tables[table][row].__setitem__(column, value))


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda folder, a, b: a.unlink(), "ParticleData.dlm: no such file"),
        (lambda folder, a, b: b.unlink(), "AdjacencyMatrix.dlm: no such file"),
        (lambda folder, a, b: [a.unlink(), b.unlink()], "no step in it"),
        (lambda folder, a, b: b.write_text(""), "AdjacencyMatrix.dlm: empty"),
        (edited(lambda rows, _: rows.pop()), "3 × 4 numbers for 4 disks"),
        (edited(lambda _, positions: positions.pop()), "4 × 4 numbers for 3 disks"),
        (edited(lambda rows, _: rows[2].pop()), "line 3: 4 finite numbers"),
        (edited(lambda _, positions: positions.reverse()), "line 1: ids 1, 2, …"),
        (set_cell(1, 2, "nan"), "line 2: 4 finite numbers"),
        (set_cell(1, 2, "x"), "line 2: '.*': numbers, with decimal points or commas"),
        (set_cell(1, 2, "0;" * 900), "line 2: '.{60}': numbers, with"),
        (set_cell(1, 2, "0;0,1"), "line 2: '.*': numbers, with"),
        (set_cell(1, 2, "-0.1"), "line 2: a force below 0"),
        (set_cell(1, 1, "0.1"), "line 2: a force of a disk on itself"),
        (set_cell(2, 3, "0", table=1), "line 3: a radius > 0"),
        (set_cell(2, 1, "900", table=1), "disks 2 and 3 have a force and do not touch"),
    ],
)
def test_what_is_wrong_with_the_files(tmp_path, harm, words):
    write(tmp_path, square(), np.array([[1.0] * 4, [1.1] * 4]))
    harm(tmp_path, *sorted(tmp_path.iterdir(), reverse=True))
    with pytest.raises(ValueError, match=words):
        only(tmp_path)


@pytest.mark.parametrize(
    ("bond", "words"),
    [
        ("0 9 0 0 1", "line 2: not two of 4 disks"),
        ("1 1 0 0 1", "line 2: not two of 4 disks"),
        ("0 1 0 0 1", "line 2: a pair again"),
        ("2 1 0 0 -1", "line 2: a force below 0"),
        ("2 1 0 0", "line 2: 5 finite numbers"),
    ],
)
def test_what_is_wrong_with_bonds(tmp_path, bond, words):
    np.savetxt(tmp_path / "coordinates.txt", np.column_stack([SQUARE, np.full(4, 20.0)]))
    (tmp_path / "bonds.txt").write_text(f"1 0 0 0 1\n{bond}\n")
    with pytest.raises(ValueError, match=words):
        only(tmp_path)


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    folder = tmp_path_factory.mktemp("twin")
    return folder, write_twin(folder, steps=2, n=60)


def test_scores_of_the_truth_and_of_nothing(twin):
    folder, _ = twin
    packing = read_packing("a", *next(iter(steps_of(folder).values())))
    best, sigma = score(packing, packing.force), packing.sigma[packing.carries]
    assert best[:5] == pytest.approx((1, 1, 0, 1, 1))
    wanted = -np.log(np.sqrt(2 * np.pi) * sigma).mean()
    assert best.log_likelihood == pytest.approx(wanted, abs=0.01)
    flat = score(packing, np.ones(len(packing.force)))
    assert (flat.correlation, flat.auc) == (0.0, 0.5)


def test_measured_forces_are_near_equilibrium_with_their_friction_alone(twin):
    folder, true = twin
    for (name, files), force in zip(steps_of(folder).items(), true, strict=True):
        packing = read_packing(name, *files)
        assert np.corrcoef(packing.force, force)[0, 1] > 0.9
        frictional, smooth = distance(packing, MU).rms, distance(packing, 0.0).rms
        assert frictional < 1.0
        assert frictional < 0.75 * smooth
        assert frictional < 0.75 * distance(packing, MU, 1).rms


def test_bands_of_the_right_law_hold_what_they_promise_and_those_of_another_do_not():
    """The share of true forces within bands of 90 % of the ensemble, and the mean correlation; loads
    have the noise that it allows for."""
    inside: dict[float, list[bool]] = {MU: [], 0.0: []}
    alike: dict[float, list[float]] = {MU: [], 0.0: []}
    for seed in range(12):
        packing = bare(*disks(40, seed))
        force, load = twins.truth(packing, seed=seed)
        edge, inner = packing.boundary, packing.inner
        load[edge] += EDGE * SCALE_N * np.random.default_rng(seed).normal(size=(edge.sum(), 2))
        packing.__dict__["loads"] = load
        spread = open_by(packing, INNER * SCALE_N, EDGE * SCALE_N)
        for mu in inside:
            balance_of = equilibrium(packing, mu)
            some = ensemble(balance_of, SCALE_N, spread, seed=seed, chains=2, draws=250, most_sweeps=4000)
            low, high = some.quantile(0.05), some.quantile(0.95)
            inside[mu].extend(((force >= low) & (force <= high))[inner])
            alike[mu].append(np.corrcoef(some.mean()[inner], force[inner])[0, 1])
    assert 0.85 < np.mean(inside[MU]) < 0.95
    assert np.mean(inside[0.0]) < 0.8
    assert np.mean(alike[0.0]) < np.mean(alike[MU])


def test_bands_fail_if_the_law_does_not_know_who_touches(tmp_path):
    """15 % of the near pairs do not touch: bands of 90 % then hold half of the forces, and again
    about nine tenths if balance may be open by 1.2 f. Where all touch they hold nine tenths."""
    constrained = {}
    for fraction, inner in ((1.0, INNER), (0.85, INNER), (0.85, 1.2)):
        folder = tmp_path / f"{fraction}"
        folder.mkdir(exist_ok=True)
        write_twin(folder, steps=2, n=100, seed=10, fraction=fraction)
        fractions = []
        for name, files in steps_of(folder).items():
            packing = read_packing(name, *files)
            drawn = models.sampled(packing, MU, 1.0, inner, 0).draws
            one = drawn.reshape(-1, drawn.shape[2])[:, : len(packing.force)]
            fractions.append(bands(packing, one, 0.0)[0])
        constrained[fraction, inner] = np.mean(fractions)
    assert constrained[1.0, INNER] > 0.84
    assert constrained[0.85, INNER] < 0.7
    assert constrained[0.85, 1.2] > 0.84


def test_the_command_on_a_twin(twin, percussions, monkeypatch, tmp_path):
    folder, _ = twin
    monkeypatch.setattr(models, "SAMPLING", FEW)
    monkeypatch.setattr("nscd.indeterminacy.nearest.ACCURATE", 1e-30)
    done = percussions("measured", folder, "--bands", "--out", tmp_path)
    assert done.returncode == 0
    assert "ensemble, μ = 0.3" in done.stdout
    with (tmp_path / "measured.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["step"] for row in rows} == {"DSC05384", "DSC05386"}
    mean = {row["model"]: float(row["correlation"]) for row in rows}
    assert mean["mean field"] == 0.0
    assert mean["ensemble, μ = 0.3"] > 0.3 > mean["shuffled"]
    page = (tmp_path / "index.html").read_text()
    assert "Best prediction" in page
    assert "on steps that did not choose it" in page
    for what in ("distance, μ = 0.05", "distance, shuffled, μ = 0.3"):
        assert f"DSC05384, {what}: inaccurate" in page


def test_what_the_command_refuses(percussions, tmp_path, twin):
    none = percussions("measured", tmp_path / "no")
    other = percussions("measured", twin[0], "--step", "DSC1")
    assert "no such folder" in none.stderr
    assert "no step DSC1. There are DSC05384" in other.stderr
    write(tmp_path, square(), np.full((2, 4), 0.1))
    small = percussions("measured", tmp_path)
    assert "DSC1: 0 forces inside" in small.stderr
    assert 0 not in (none.returncode, other.returncode, small.returncode)


def test_a_model_error_widens_bands(twin):
    packing = read_packing("a", *next(iter(steps_of(twin[0]).values())))
    draws = np.tile(packing.scale, (50, len(packing.force)))
    narrow, width = (bands(packing, draws, error * packing.scale) for error in (0.0, 2.0))
    assert narrow[0] < 0.9 < width[0]
    assert width[2] > 3 * narrow[2]


def test_distance_is_that_of_contacts_with_a_force():
    """Without friction an inner disk between two others takes F₁ ≠ F₂ up to the tolerance: half of the
    rest is missing on both sides. A contact without a force does not count, and shuffling leaves it."""
    anchor = np.array([[0.0, 0], [40, 0], [80, 0], [0, 40]])
    snapshot = disks_at(anchor, np.full(4, 20.0))
    contacts, where = contacts_listed(snapshot, np.array([0, 1]), np.array([1, 2]))
    force = np.zeros(len(contacts))
    force[where] = 1.0, 1.6
    sides = 2 * (force > 0)
    packing = Packing(
        name="row", snapshot=snapshot, contacts=contacts, force=force, sides=sides,
        error=ErrorBar(0.0, 0.1), least=0.01,
    )  # fmt: skip
    packing.__dict__["boundary"] = np.array([True, False, True, True])
    expected = (0.6 - models.TOLERANCE * packing.scale) / 2 / 0.1
    assert len(contacts) == 3
    for seed in (None, 1, 2):
        assert distance(packing, 0.0, seed).rms == pytest.approx(expected)


@pytest.mark.parametrize("between", [",", ";", "\t"])
def test_files_are_read_as_they_are_published(tmp_path, between):
    """Whole numbers, five digits, and tiny ones with an exponent, as dlmwrite writes them; other
    matrices beside. With decimal commas too, in tables of a German spreadsheet."""
    (tmp_path / f"{PREFIX.format('05384')}ParticleData.dlm").write_text(
        "1,121,1563.5,30,0\n2,179.52,1563.5,29,14.081\n3,121,1504.4,29,34.781\n"
    )
    normal = "0,0.016464,0.040328\n0.02402,0,0\n9.3638e-05,0,0\n"
    for what in ("NormWeighted", "TanWeighted", "AbsWeighted", "Binary"):
        text = normal if what == "NormWeighted" else "0,-2.5212e-05,1\n" * 3
        (tmp_path / f"{PREFIX.format('05384')}{what}AdjacencyMatrix.dlm").write_text(text)
    for path in tmp_path.iterdir() if between != "," else ():
        path.write_text(path.read_text().replace(",", between).replace(".", ","))
    read = only(tmp_path)
    assert read.name == "DSC05384"
    assert read.snapshot.radius.tolist() == [30, 29, 29]
    assert read.force == pytest.approx([(0.016464 + 0.02402) / 2, (0.040328 + 9.3638e-05) / 2])
    assert read.sides.tolist() == [2, 2]
