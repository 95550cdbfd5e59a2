"""The benchmark in Exudyn: absolute nodal coordinates (large deflections) and linear finite elements.

The root of the shaft carries a mass so large that a force on it prescribes the base acceleration; one Python function
per step writes that force and reads the accelerations, the least that Exudyn needs for a sampled excitation.
Generalised-α integrator with a fixed step, modified Newton, relative tolerance 1e-6, sparse solver. Bushings are
Exudyn's spring-dampers with limit stops.
"""

import exudyn
import numpy as np
from exudyn import itemInterface as items

import clearance_mj as cm
from clearance_mj.signals.sampling import decimate, interpolate

from .case import BAND, FS, LAW, RIG

BASE_MASS = 1e5  # kg; a ten-thousandth of it is more than the shaft weighs


def run(add_shaft, split, factor, excitation):
    """Simulate; ``split`` elements from one sensor or bushing to the next, ``factor`` steps per sample."""
    system = exudyn.SystemContainer().AddSystem()
    x = _mesh(split)
    markers, vertical = add_shaft(system, x)
    for j, bushing in enumerate(RIG.bushings):
        _add_bushing(system, bushing, LAW.k[j], LAW.c[j], [markers[0], markers[_nearest(x, bushing.position)]])
    load = system.AddLoad(items.LoadCoordinate(markerNumber=markers[0]))
    columns = vertical[[_nearest(x, sensor.position) for sensor in RIG.sensors]]
    drive = interpolate(excitation.value, factor)
    out, step = np.empty((drive.size, columns.size)), iter(range(drive.size))

    def before(system, _):
        i = next(step)
        out[i] = system.systemData.GetODE2Coordinates_tt()[columns]  # at the end of the step before
        system.SetLoadParameter(load, "load", BASE_MASS * drive[min(i + 1, drive.size - 1)])
        return True

    system.SetPreStepUserFunction(before)
    system.Assemble()
    system.SolveDynamic(_settings(drive.size, factor))
    return cm.Response(FS, excitation.value, decimate(out, factor).T, band=BAND)


def finite_elements(system, x):
    """Add Hermite beam elements as one linear system; return the markers and coordinates of the nodes' heights."""
    beam, n = RIG.beam, 2 * x.size
    mass, stiffness = np.zeros((2, n, n))
    for e, h in enumerate(np.diff(x)):
        at = slice(2 * e, 2 * e + 4)
        unit = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
        inertia = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
        scale = np.outer(*[[1, h, 1, h]] * 2)
        stiffness[at, at] += beam.bending_stiffness / h**3 * unit * scale
        mass[at, at] += beam.mass_per_length * h * inertia * scale
    mass[0, 0] += BASE_MASS
    mass[-2, -2] += RIG.masses[0].mass
    free = np.delete(np.arange(n), 1)  # the root does not turn
    mass, stiffness = mass[np.ix_(free, free)], stiffness[np.ix_(free, free)]
    rest = [0.0] * free.size
    coordinates = {"referenceCoordinates": rest, "initialCoordinates": rest, "initialCoordinates_t": rest}
    node = system.AddNode(items.NodeGenericODE2(numberOfODE2Coordinates=free.size, **coordinates))
    matrices = {"massMatrix": mass, "stiffnessMatrix": stiffness, "dampingMatrix": beam.rayleigh[1] * stiffness}
    system.AddObject(items.ObjectGenericODE2(nodeNumbers=[node], **matrices))
    vertical = np.searchsorted(free, np.arange(0, n, 2))
    return [_marker(system, node, int(c)) for c in vertical], vertical


def absolute_nodal(system, x):
    """Add ANCF cable elements; return the markers and coordinates of the nodes' heights."""
    beam = RIG.beam
    axial = beam.bending_stiffness * 16 / beam.diameter**2  # E A of a round shaft
    nodes = [system.AddNode(items.NodePoint2DSlope1(referenceCoordinates=[p, 0, 1, 0])) for p in x.tolist()]
    section = {"massPerLength": beam.mass_per_length, "bendingStiffness": beam.bending_stiffness}
    section |= {"bendingDamping": beam.rayleigh[1] * beam.bending_stiffness}
    section |= {"axialStiffness": axial, "axialDamping": beam.rayleigh[1] * axial}
    for h, pair in zip(np.diff(x), zip(nodes, nodes[1:])):
        system.AddObject(items.Cable2D(length=h, nodeNumbers=list(pair), **section))
    for node, mass in ((nodes[0], BASE_MASS), (nodes[-1], RIG.masses[0].mass)):
        matrices = {"massMatrix": np.diag([mass, mass, 0, 0]), "stiffnessMatrix": np.zeros((4, 4))}
        system.AddObject(items.ObjectGenericODE2(nodeNumbers=[node], dampingMatrix=np.zeros((4, 4)), **matrices))
    ground = _marker(system, system.AddNode(items.NodePointGround()), 0)
    for coordinate in (0, 2, 3):  # the root moves up and down alone
        markers = [ground, _marker(system, nodes[0], coordinate)]
        system.AddObject(items.CoordinateConstraint(markerNumbers=markers))
    return [_marker(system, node, 1) for node in nodes], np.arange(1, 4 * x.size, 4)


def _add_bushing(system, bushing, k, c, markers):
    state = system.AddNode(items.NodeGenericData(numberOfDataCoordinates=3, initialCoordinates=[1, 0, 0]))
    grease = {"stiffness": bushing.grease.stiffness, "damping": bushing.grease.damping}
    stops = {"limitStopsUpper": bushing.gap, "limitStopsLower": -bushing.gap, "useLimitStops": True}
    stops |= {"limitStopsStiffness": k, "limitStopsDamping": c}
    connector = items.ObjectConnectorCoordinateSpringDamperExt
    system.AddObject(connector(markerNumbers=markers, nodeNumber=state, **grease, **stops))


def _marker(system, node, coordinate):
    return system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))


def _mesh(split):
    inside = {p.position for p in (*RIG.sensors, *RIG.bushings)}
    marks = np.array(sorted({0.0, RIG.beam.length, *inside}))
    return np.interp(np.arange((marks.size - 1) * split + 1) / split, np.arange(marks.size), marks)


def _nearest(x, position):
    return int(np.argmin(np.abs(x - position)))


def _settings(steps, factor):
    settings = exudyn.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = steps - 1, (steps - 1) / (FS * factor)
    integration.adaptiveStep = False
    integration.newton.useModifiedNewton, integration.newton.relativeTolerance = True, 1e-6
    settings.solution.file.write = False
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    return settings
