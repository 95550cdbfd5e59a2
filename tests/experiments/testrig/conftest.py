import numpy as np
import pytest

from experiments.testrig.bench import greases
from experiments.testrig.fem import FiniteElements


@pytest.fixture(scope="session")
def free_masses():
    """Four masses of 0.7 kg that nothing holds: the smallest system that the banded solver takes."""
    mass = np.zeros((4, 4))
    mass[0] = 0.7
    return FiniteElements(mass, np.zeros((4, 4)), np.zeros(4), (0.0, 0.0), 1.0)


@pytest.fixture(scope="session")
def no_grease():
    return greases(())
