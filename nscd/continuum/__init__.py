"""The crowd as a deformable solid: rooms, meshes, the collision (11) of the paper, pressure.

Raises ImportError where scikit-fem or netgen-mesher is not installed."""

from importlib.util import find_spec

for _library, _name in (("skfem", "scikit-fem"), ("netgen", "netgen-mesher")):
    if find_spec(_library) is None:
        raise ModuleNotFoundError(
            f'nscd.continuum needs {_name}: pip install "crowd-percussions[continuum]"',
            name=_library,
        )
