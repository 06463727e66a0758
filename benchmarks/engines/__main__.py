"""Runs every scene in every engine that is installed, and judges the contact forces that it reports.

    python -m benchmarks.engines [NAME …] [--install] [--out out/engines]

`--install` makes an environment of each engine in OUT/installed. Writes OUT/engines.csv, a line for each engine,
variant and scene. Lines of engines that were not run stay. An engine that is not installed
is a line that says how to get it."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.engines.judging import judged
from benchmarks.engines.scenes import scenes

HERE = Path(__file__).parent
MOST_S = 600


class Engine:
    """An engine of engines.toml, its environment in a folder. Without pip, npm and command it is this Python's."""

    def __init__(self, name: str, arguments: dict[str, Any], installed: Path) -> None:
        self.name, self.arguments, self.folder = name, arguments, installed.resolve() / name
        self.variants = arguments.get("variants", ["default"])
        self.script = next(HERE.glob(f"{name}_.*"))
        python = self.folder / "bin" / "python"
        self.own = "pip" in arguments and not python.exists() and _has(arguments["pip"])
        self.command = arguments.get("command") or (
            ["node"] if "npm" in arguments else [str(python) if "pip" in arguments and not self.own else sys.executable]
        )

    @property
    def install_lines(self) -> list[list[str]]:
        """Give the commands that install it; none for what the system or this project brings."""
        if "npm" in self.arguments:
            return [["npm", "install", "--silent", "--prefix", str(self.folder), *self.arguments["npm"]]]
        pip = [str(self.folder / "bin" / "python"), "-m", "pip", "install", "-q", *self.arguments.get("pip", [])]
        return [[sys.executable, "-m", "venv", str(self.folder)], pip] if "pip" in self.arguments else []

    @property
    def is_installed(self) -> bool:
        """Whether it can run."""
        there = (self.folder / "node_modules").exists() if "npm" in self.arguments else shutil.which(self.command[0])
        module = self.arguments.get("module")  # of a Python that is there anyway
        if there and module:
            return not subprocess.run([*self.command, "-c", f"import {module}"], capture_output=True, check=False).returncode
        return bool(there)

    def run(self, scene: dict[str, Any], folder: Path, variant: str) -> str:
        """Run a scene; give nothing, or why there is no result."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
        paths = [HERE, HERE.parents[1] / "yade_scripts", HERE.parents[1], *filter(None, [os.environ.get("PYTHONPATH")])]
        know = {"ENGINE": str(self.folder), "PYTHONPATH": os.pathsep.join(map(str, paths)), "PYTHONDONTWRITEBYTECODE": "1"}
        words = [*self.command, str(self.script), str(folder.resolve() / "scene.json"), str(folder.resolve()), variant]
        try:
            ended = subprocess.run(words, env=os.environ | know, capture_output=True, text=True, timeout=MOST_S, check=False)
        except subprocess.TimeoutExpired:
            return f"no end after {MOST_S} s"
        return (ended.stderr.strip() or ended.stdout.strip() or "ended").splitlines()[-1] if ended.returncode else ""


def _has(packages: list[str]) -> bool:
    """Whether this Python has the first of some packages."""
    from importlib.metadata import distributions

    return packages[0].split("==")[0] in {one.name for one in distributions()}


def engines(installed: Path) -> list[Engine]:
    """Give all engines."""
    listed = tomllib.loads((HERE / "engines.toml").read_text(encoding="utf-8"))
    return [Engine(name, inputs, installed) for name, inputs in listed.items()]


def row_of(engine: Engine, variant: str, name: str, folder: Path) -> dict[str, Any]:
    """Run a scene in an engine and judge it: a line of the table."""
    scene, row = scenes()[name], {"engine": engine.name, "variant": variant, "scene": name}
    if why := engine.run(scene, folder, variant):
        return row | {"verdict": f"failed: {why}"}
    known = json.loads((folder / "engine.json").read_text(encoding="utf-8"))
    found, creep, lift = verdict = judged(folder, scene, known["step_s"])
    own = {"version": known["version"], "status": found.status, "verdict": verdict.cell, "words": found.words}
    return row | own | {"remarks": ". ".join(found.remarks), "creep_m_per_s": creep, "lift_m": lift}


def main() -> None:
    """Run and judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--install", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("out/engines"))
    args = parser.parse_args()
    rows = []
    for engine in engines(args.out / "installed"):
        if args.names and engine.name not in args.names:
            continue
        if args.install and not engine.is_installed:
            for line in engine.install_lines:
                subprocess.run(line, check=False)
        if not engine.is_installed:
            how = " && ".join(map(" ".join, engine.install_lines)) or engine.arguments["install"]
            print(f"{engine.name}: not installed: {how}")
            continue
        for variant in engine.variants:
            for name in scenes():
                rows.append(row_of(engine, variant, name, args.out / engine.name / variant.replace("/", "_") / name))
                print(engine.name, variant, name, rows[-1].get("version", ""), rows[-1]["verdict"], flush=True)
    table, file = pd.DataFrame(rows), args.out / "engines.csv"
    if file.exists() and rows:
        old = pd.read_csv(file, keep_default_na=False)
        table = pd.concat([old[~old.engine.isin(table.engine)], table]).sort_values("engine", kind="stable")
    table.to_csv(file, index=False)


if __name__ == "__main__":
    main()
