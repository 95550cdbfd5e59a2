"""A structure with joints that slip, from its response to a periodic force at several levels.

A joint that slips (a payload in its mounting, a bolted lap) lowers natural frequencies and adds damping as the level
rises. Which modes it does this to says where it acts: its deformation is η = Σ ψ_m q_m, with a displacement ψ_m in
every mode m. Sensors on either side of a joint see rigid motions besides, so that ψ is not always the difference of
their shapes; it can be identified like a shape. The joint's force is that of Jenkins elements, springs that slide
beyond given slip lengths (W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic
response, J. Appl. Mech. 33, 1966).

Modes, shapes, ψ and springs are fitted together by output error: the modal engine is driven by the measured force, and
the spectra of the accelerations at the excited lines are compared with the measured ones. Slip lengths form a fixed
geometric series over the joints' motion, so that the force is linear in the springs that are searched for.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.ndimage
from tqdm import tqdm

from clearance_mj import Bushing, Contact, Excitation, Grease, RecordError, Response, Rig, Sensor, Shaker
from clearance_mj.clearance import ConstantLaw, MaxwellSlip
from clearance_mj.engines import simulate_and_keep
from clearance_mj.estimate import Parameter, Problem, Solution, StoppingCriteria, solve
from clearance_mj.signals.frf import FRF, QUANTITY
from clearance_mj.signals.nonlinear import periods
from clearance_mj.signals.welch import lines_within
from clearance_mj.structure import ModalStructure, modes_from_frf

JOINT_NODE = 901  # node of the first joint's degree of freedom in the structure; those that follow count on
SETTLING = 2  # periods that are simulated before the one that is compared
SOFTENING = 0.02  # relative, by which all joints together lower every natural frequency, to begin with
NARROWEST, WIDEST = 0.5, 2.0  # slip lengths over the RMS of a joint's motion: at the lowest and at the highest level
SMOOTHED = 9  # lines over which a spectrum's power is averaged to weigh residuals by
FLOOR = 0.1  # fraction of a record's mean power that is added, so that the strong lines count for more
FREE = 1.0  # m: gap of a joint, whose walls are never reached
WEAKEST = 1e-9  # of the joints' stiffness: spring that stands for none, as a law has none of zero
SMALL = {"frequency": 0.02, "damping": 0.005, "shape": 0.1, "joint": 0.3, "spring": 0.15}
"""Units in which parameters vary: of a damping ratio, of all others relative to their usual size"""
DIFFERENCE = 1e-3  # of these units, for differences
RATIOS = 3e-4, 0.4  # damping ratios that are possible
ROUGH, FINE = 1e-2, 1e-3  # relative decrease of the cost that ends a fit: to the lowest levels, and to all
EARLY_STEPS = 8  # at most, of the fits to the lowest levels
Joint = tuple[str, str] | None


@dataclass(frozen=True, eq=False)
class JointedStructure:
    """A structure with joints, fitted to records."""

    rig: Rig
    """the modes, sensors and drive; each joint is a clearance whose walls are never reached"""
    law: ConstantLaw
    """the Jenkins elements of the joints, as its grease"""
    linear: ModalStructure
    """modes of the lowest level, from which the search began"""
    cost: float
    """sum of the squared weighted residuals"""
    error: np.ndarray
    """(n_records, n_sensors) RMS error of simulations in the band, over the RMS of the record"""
    motion: np.ndarray
    """(n_records, n_joints) m, largest deformation of each joint"""
    simulations: int
    """number of simulations of the fit"""


def fit_jointed_structure(
    responses: Sequence[Response], period: float, joints: Sequence[Joint] = (None, None), *, slips: int = 6,
    drop: int = 1, drive: str | None = None, modes: ModalStructure | None = None, seed: int = 0, n_starts: int = 1,
    steps: int = 40, progress: bool = False,
) -> JointedStructure:  # fmt: skip
    """Identify a structure with joints that slip from its responses to a periodic force at several levels.

    Parameters
    ----------
    responses : sequence of Response
        One record for each level, two levels or more: whole periods, of one sampling rate, band, sensors and force.
    period : float
        Period of the excitation, s.
    joints : sequence of (str, str) or None
        For each joint the two responses whose relative motion it works on; None where that is to be identified. The
        scale of a deformation that is identified is a convention: it has the RMS of the driving point's displacement at
        the lowest level.
    slips : int
        Jenkins elements of each joint.
    drop : int
        Periods at the start of each record that are left out until the transient has died.
    drive : str, optional
        Response at the point where the force acts. Default: the records' reference.
    modes : ModalStructure, optional
        Modes from which the fit begins. Default: those of `modes_from_frf` in the FRFs of the lowest level.
    seed : int
        Seed of the deformations from which the search begins.
    n_starts : int
        Draws of them, of which the best after a rough fit to the two lowest levels is kept; there are local minima,
        which ``cost`` tells apart.
    steps : int
        Most steps of the fit to all levels.
    progress : bool
        Show a progress bar.

    Returns
    -------
    JointedStructure
        The structure and the law of its joints.

    Raises
    ------
    RecordError
        If records are fewer than two, differ, hold no whole periods, have no band, or do not measure the drive, or a
        joint is between responses that are not measured.

    Notes
    -----
    Residuals are differences of the complex spectra at the lines of the records' band, over the root of the measured
    power near by and of a fraction of the mean. Levels are added one at a time, from the lowest, so that no resonance
    starts far from its measured frequency.
    """
    levels = _Levels(responses, period, joints, slips, drop, drive)
    linear = modes or levels.lowest_modes()
    with tqdm(desc="joints", unit=" simulations", disable=not progress) as levels.bar:
        rng, size = np.random.default_rng(seed), (n_starts, len(joints), linear.omega.size)
        pulls = rng.choice([-1.0, 1.0], size) * rng.uniform(0.5, 1.5, size)
        pulls[0, 0] = 1.0
        rough = [levels.solve(levels.start(linear, pull), 2, ROUGH, EARLY_STEPS) for pull in pulls]
        solution = min(rough, key=lambda s: s.cost)
        for count in range(3, len(responses)):
            solution = levels.solve(solution.values, count, ROUGH, EARLY_STEPS)
        solution = levels.solve(solution.values, len(responses), FINE, steps)
        return levels.result(solution, linear)


class _Levels:
    """Measured spectra by level, the lowest first, and those of structures with joints."""

    def __init__(
        self, responses: Sequence[Response], period: float, joints: Sequence[Joint], slips: int, drop: int,
        drive: str | None,
    ):  # fmt: skip
        if len(responses) < 2:
            raise RecordError(f"joints show in what changes with the level: {len(responses)} records, needs two")
        if not joints or slips < 1:
            raise RecordError(f"needs one joint or more with one slip length or more, got {len(joints)} and {slips}")
        first = responses[0]
        if len({(r.fs, r.kind, r.band, r.responses, r.reference) for r in responses}) > 1 or first.kind != "force":
            raise RecordError("the records must be of one sampling rate, band, set of responses and force")
        if first.band is None:
            raise RecordError("the records have no band; give that of the excitation")
        self.sensors, self.drive = first.responses, drive or first.reference
        for label in (self.drive, *(end for joint in joints if joint for end in joint)):
            if label not in self.sensors:
                raise RecordError(f"{label} is not among the responses {', '.join(self.sensors)}")
        self.joints, self.slips, self.unknown = joints, slips, sum(joint is None for joint in joints)
        self.order = np.argsort([np.std(r.excitation) for r in responses])
        means = [periods(responses[i], period, drop).mean(axis=1) for i in self.order]
        self.size = means[0].shape[1]
        frequency = np.arange(self.size // 2 + 1) * (first.fs / self.size)
        self.lines = lines_within(frequency, first.band)
        self.frequency = frequency[self.lines]
        self.excitations = [Excitation(np.tile(m[0], SETTLING + 1), first.fs, "force", first.band) for m in means]
        spectra = [np.fft.rfft(mean)[:, self.lines] for mean in means]
        self.force, self.measured = [s[0] for s in spectra], [s[1:] for s in spectra]
        self.weights = [_weight(value) for value in self.measured]
        self.simulations, self.bar = 0, tqdm(disable=True)

    def lowest_modes(self) -> ModalStructure:
        """Return the modes of the lowest level's FRFs, and those that stand for the flexibility of others."""
        value = self.measured[0] / self.force[0]
        frf = FRF(self.frequency, value, None, self.sensors, (self.drive,), QUANTITY["force"])
        modes = modes_from_frf(frf).structure.assemble((self.drive,), 0)
        omega = np.sqrt(modes.stiffness.diagonal())
        return _structure(omega / (2 * np.pi), modes.viscous.diagonal() / (2 * omega), self.sensors,
                          modes.rows(self.sensors))  # fmt: skip

    def start(self, linear: ModalStructure, pulls: np.ndarray) -> np.ndarray:
        """Return the parameters of given modes with joints that modes work in proportion to pulls (n_joints, n_modes).

        The modes are those of stuck joints, whose stiffness is taken off. Sets slip lengths and parameter units.
        """
        omega, ratios, n = linear.omega, linear.ratios, linear.omega.size
        shapes = linear.assemble((), 0).rows(self.sensors)
        row = dict(zip(self.sensors, shapes))
        w = 2 * np.pi * self.frequency
        receptance = 1 / (omega[:, None] ** 2 - w**2 + 2j * (ratios * omega)[:, None] * w)
        motions = [row[self.drive][:, None] * receptance * force for force in (self.force[0], self.force[-1])]
        pulls = pulls * np.sign(row[self.drive])  # with the driving point's motion, or against it
        psi = np.array([pull * omega if joint is None else row[joint[0]] - row[joint[1]]
                        for pull, joint in zip(pulls, self.joints)])  # fmt: skip
        free = np.array([joint is None for joint in self.joints])
        size = np.linalg.norm(psi[free] @ motions[0], axis=1, keepdims=True)
        psi[free] *= np.linalg.norm(row[self.drive] @ motions[0]) / size
        low, high = (np.sqrt(2) / self.size * np.linalg.norm(psi @ q, axis=1) for q in motions)
        self.slip_lengths = np.geomspace(NARROWEST * low, WIDEST * high, self.slips, axis=1)
        stiffness = 2 * SOFTENING / len(psi) / np.mean((psi / omega) ** 2, axis=1)
        springs = np.repeat(stiffness[:, None] / self.slips, self.slips, axis=1)
        squared, vectors = np.linalg.eigh(np.diag(omega**2) - psi.T * stiffness @ psi)
        slipping = np.sqrt(np.maximum(squared, (omega[0] / 2) ** 2))
        damping = np.sum(vectors**2 * (2 * ratios * omega)[:, None], axis=0) / (2 * slipping)
        rows = np.vstack((shapes, psi[free])) @ vectors
        usual = np.repeat(np.sqrt(np.mean(rows**2, axis=1)), n)
        usual *= np.repeat((SMALL["shape"], SMALL["joint"]), (shapes.size, free.sum() * n))
        self.small = np.concatenate((
            SMALL["frequency"] * slipping / (2 * np.pi), np.full(n, SMALL["damping"]), usual,
            np.repeat(SMALL["spring"] * stiffness, self.slips),
        ))  # fmt: skip
        return np.concatenate((slipping / (2 * np.pi), damping, rows.ravel(), springs.ravel()))

    def parts(self, theta: np.ndarray) -> list[np.ndarray]:
        """Frequencies, Hz, damping ratios, shapes (n_sensors + n_unknown, n_modes) and springs (n_joints, n_slips)."""
        rows = len(self.sensors) + self.unknown
        n = (theta.size - len(self.joints) * self.slips) // (2 + rows)
        frequency, ratios, shapes, springs = np.split(theta, [n, 2 * n, (2 + rows) * n])
        return [frequency, ratios, shapes.reshape(rows, n), springs.reshape(-1, self.slips)]

    def case(self, theta: np.ndarray) -> tuple[Rig, ConstantLaw]:
        """Return the rig and the law of parameters."""
        frequency, ratios, shapes, springs = self.parts(theta)
        places = [f"{JOINT_NODE + j}:+Z" for j in range(self.unknown)]
        unknown = iter(places)
        ends = [joint or (next(unknown), None) for joint in self.joints]
        rig = Rig(
            "structure with joints", None,
            tuple(Bushing(a, FREE, 0.0, Grease(0.0), Contact(1.0), to=b) for a, b in ends),
            tuple(Sensor(int(label.partition(":")[0]), label) for label in self.sensors),
            shaker=Shaker("force", self.drive),
            structure=_structure(frequency, ratios, (*self.sensors, *places), shapes),
        )  # fmt: skip
        springs = np.maximum(springs, WEAKEST * springs.sum())
        forces = springs * self.slip_lengths
        greases = tuple(MaxwellSlip(tuple(k), tuple(f)) for k, f in zip(springs.tolist(), forces.tolist()))
        return rig, ConstantLaw(0.0, 0.0, grease=greases)

    def residuals(self, thetas: np.ndarray, levels: int) -> np.ndarray:
        """Return (n_thetas, n_residuals) complex, of the lowest levels."""
        cases, residuals = [self.case(theta) for theta in thetas], []
        for excitation, measured, weight in zip(self.excitations[:levels], self.measured, self.weights):
            spectra = simulate_and_keep(cases, excitation, self.spectrum, forces=False)
            residuals.append(((spectra - measured) * weight).reshape(len(cases), -1))
            self.simulations += len(cases)
            self.bar.update(len(cases))
        return np.hstack(residuals)

    def spectrum(self, response: Response) -> np.ndarray:
        """Return (n_sensors, n_lines) of the last period."""
        return np.fft.rfft(response.channels[:, -self.size :])[:, self.lines]

    def solve(self, theta: np.ndarray, levels: int, decrease: float, steps: int) -> Solution:
        """Fit the lowest levels by bounded nonlinear least squares."""
        low, high = (np.full(theta.size, sign * np.inf) for sign in (-1, 1))
        of_low, of_high = self.parts(low), self.parts(high)  # views
        of_low[0][:], of_low[1][:], of_low[3][:] = 0.1 * self.frequency[0], RATIOS[0], 0.0
        of_high[1][:] = RATIOS[1]
        rows = zip(np.clip(theta, low, high).tolist(), low.tolist(), high.tolist())
        parameters = [Parameter(str(i), "", *row, transform="linear") for i, row in enumerate(rows)]
        problem = Problem(
            parameters, lambda points: self.residuals(points, levels), units=self.small, step=DIFFERENCE, lanes=False
        )
        return solve(problem, stop=StoppingCriteria(steps, decrease=decrease, move=1e-6))

    def result(self, solution: Solution, linear: ModalStructure) -> JointedStructure:
        """Return the fitted structure with its errors, records in the order given."""
        rig, law = self.case(solution.values)
        error, motion = np.empty((len(self.force), len(self.sensors))), np.empty((len(self.force), len(self.joints)))
        for place, excitation, measured in zip(self.order, self.excitations, self.measured):
            (response,) = simulate_and_keep([(rig, law)], excitation, lambda response: response)
            difference = self.spectrum(response) - measured
            error[place] = np.linalg.norm(difference, axis=1) / np.linalg.norm(measured, axis=1)
            assert response.displacement is not None
            motion[place] = np.abs(response.displacement[:, -self.size :]).max(axis=1)
        return JointedStructure(rig, law, linear, solution.cost, error, motion, self.simulations)


def _weight(value: np.ndarray) -> np.ndarray:
    power = np.abs(value) ** 2
    smoothed = scipy.ndimage.uniform_filter1d(power, SMOOTHED, axis=1, mode="nearest")
    return 1 / np.sqrt(smoothed + FLOOR * power.mean(axis=1, keepdims=True))


def _structure(frequency: np.ndarray, ratios: np.ndarray, dofs: Sequence[str], shapes: np.ndarray) -> ModalStructure:
    order = np.argsort(frequency)
    rows = tuple(map(tuple, shapes[:, order].tolist()))
    return ModalStructure(tuple(frequency[order].tolist()), tuple(ratios[order].tolist()), tuple(dofs), rows)
