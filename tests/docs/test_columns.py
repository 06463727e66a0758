"""docs/columns.md is printed by the declarations of the code. docs/scenes.md has every
key of a scene file, with its unit, range and default, and no other."""

import ast
import doctest
import re
import runpy
from fractions import Fraction

import pytest
from pydantic import BaseModel

from analysis.scene.drive import Goal, Push, Stop
from analysis.scene.scene import SceneFile
from analysis.scene.schema import Material
from analysis.studies.exposure.limits import QUANTITIES
from analysis.studies.exposure.loads import LOADS
from analysis.studies.film import summary as film
from analysis.studies.film.frame import HEADLINES, MOVED_FAR, SHOCK
from analysis.studies.motion.pairwise import WINDOWS
from analysis.studies.paper.page import Erratum
from analysis.studies.push.hindcast import SCORES
from analysis.studies.push.page import CASES
from analysis.studies.work_precision.point import POINTS, Point, columns_of
from analysis.studies.work_precision.whole_runs import COLUMNS as RUNS
from analysis.studies.work_precision.whole_runs import WholeRunPoint
from tests.docs.documented import ROOT


def test_the_page_is_what_the_code_declares():
    printed = runpy.run_path(str(ROOT / "docs/site/columns.py"))["page"]()
    assert (ROOT / "docs/columns.md").read_text(encoding="utf-8") == printed


def test_columns_of_points_and_loads():
    """Those that come from the fields of a class, or from a list of quantities."""
    assert columns_of(Point) == POINTS
    assert columns_of(WholeRunPoint) == RUNS
    quantities = {one.column for one in QUANTITIES.values()}
    assert {*LOADS} == quantities | {"time_s", "window_s", "id", "wall"}
    assert set(SCORES) < set(CASES)
    assert Erratum._fields == ("where", "printed", "correct", "why")


def test_columns_of_films():
    ends = ("", "low", "high")
    forces = {film.column(key, "N", end) for key in HEADLINES for end in ends}
    shocks = {film.column(key, "N·s", end) for key in SHOCK for end in ends}
    assert {*film.NUMBERS} == forces | shocks | {f"{key}_jump" for key in HEADLINES}
    assert MOVED_FAR in film.HEAD


def test_columns_of_windows():
    """Those of a comparison of two runs but for their measures."""
    tree = ast.parse((ROOT / "analysis/studies/motion/pairwise.py").read_text(encoding="utf-8"))
    keys = {key.value for node in ast.walk(tree) if isinstance(node, ast.Dict) for key in node.keys
            if isinstance(key, ast.Constant)}  # fmt: skip
    assert {name for name in WINDOWS if "…" not in name} <= keys


PAGE = ROOT / "docs/scenes.md"
UNITS = {
    "_m_per_s2": "m/s²", "_m_per_s": "m/s", "_N_per_m": "N/m", "_per_m2": "1/m²", "_Pa": "Pa",
    "_N_s_per_m": "N·s/m", "_kg": "kg", "_s": "s", "_m": "m", "_N": "N", "_deg": "°", "_rad": "rad",
}  # fmt: skip


def parts():
    """The tables of a scene file: heading on the page → model."""
    found, plain = {}, {}
    for key, field in SceneFile.model_fields.items():
        text = repr(field.annotation)
        names = {f"{part.__module__}.{part.__name__}": part for part in subclasses(BaseModel)}
        models = [part for name, part in names.items() if name in text]
        if models:
            (model,) = models
            found[f"`[[{key}]]`" if "tuple" in text else f"`[{key}]`"] = model.model_fields, model
        else:
            plain[key] = field
    material = {"`[contact]` of a material": (Material.model_fields, Material)}
    push = {"`[drive]` of a push": (Push.model_fields, Push)}
    push["`[[drive.goals]]`"] = (Goal.model_fields, Goal)
    push["`[[drive.stops]]`"] = (Stop.model_fields, Stop)
    return {"The scene": (plain, SceneFile), **found, **material, **push}


def subclasses(model):
    return {model, *(below for sub in model.__subclasses__() for below in subclasses(sub))}


def rows(heading):
    """The rows of the table of keys below a heading."""
    text = re.split(r"^## ", PAGE.read_text(encoding="utf-8"), flags=re.M)
    (part,) = (part for part in text if part.startswith(f"{heading}\n"))
    found = {}
    for line in part.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 5 and cells[0].startswith("`"):
            found[cells[0].strip("`")] = cells[1:]
    return found


def accepted(schema):
    """What a key takes, as the page says it."""
    schema = next((one for one in schema.get("anyOf", ()) if one.get("type") != "null"), schema)
    if "enum" in schema:
        return " or ".join(f"`{word}`" for word in schema["enum"])
    if "prefixItems" in schema:
        full = schema["prefixItems"][0]["type"] == "integer"
        return f"two {accepted(schema['prefixItems'][0])}" if full else "(x, y)"
    if schema["type"] == "array":
        many = {"integer": "whole numbers", "number": "numbers", "string": "texts"}
        kind = schema["items"].get("type")
        return f"list of {many[kind]}" if kind in many else "tables"
    if schema["type"] == "string":
        return "text"
    if schema["type"] == "boolean":
        return "true or false"
    # all numbers are within ±1e30, which the page says once
    low, high = (schema[end] if abs(schema.get(end, 1e30)) < 1e30 else None
                 for end in ("minimum", "maximum"))  # fmt: skip
    if "exclusiveMinimum" in schema:
        ends = f"> {schema['exclusiveMinimum']:g}" + (f", ≤ {high:g}" if high is not None else "")
        ends += f", < {schema['exclusiveMaximum']:g}" if "exclusiveMaximum" in schema else ""
    elif high is not None:
        ends = f"{low:g} to {high:g}"
    else:
        ends = "" if low is None else f"≥ {low:g}"
    full = "whole" if schema["type"] == "integer" else ""
    return ", ".join(word for word in (full, ends) if word) or "any"


def unit_of(key):
    if key.endswith("over_1_cm"):
        return ""
    return next((unit for end, unit in UNITS.items() if key.endswith(end)), "")


def same(shown, default):
    """Whether the page's default is the model's."""
    if default in (None, ()):
        return shown == "–"
    if isinstance(default, str):
        return shown == f"`{default}`"
    return float(Fraction(shown)) == default


@pytest.mark.parametrize("heading", parts())
def test_every_key_of_a_table(heading):
    fields, model = parts()[heading]
    shown = rows(heading)
    assert list(shown) == list(fields)
    schema = model.model_json_schema()["properties"]
    for key, (unit, accepts, default, _) in shown.items():
        field = fields[key]
        assert unit == unit_of(key), key
        assert accepts == accepted(schema[key]), key
        assert default == "required" if field.is_required() else same(default, field.default), key


def test_python_of_the_page():
    assert doctest.testfile(str(PAGE), module_relative=False).failed == 0
    assert doctest.testfile(str(PAGE), module_relative=False).attempted == 4
