"""A vehicle whose steering shaft has clearance: paths, plants, steering, controllers, runs and their comparison."""

from importlib.util import find_spec

from ..core.errors import ClearanceError

if missing := [name for name in ("vehiclemodels", "osqp") if find_spec(name) is None]:
    raise ClearanceError(
        f"the vehicle part needs {' and '.join(missing)}, not installed: pip install 'clearance-mj[vehicle]'"
    )
