"""Compiled loops of the energy balance: what bushings do in a block of steps, and their impacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..clearance.follower import contact_force, signed_penetration
from ..clearance.kernel import Clearance, contact_step, follow_law, grease_step
from ..clearance.pointers import at, call_contact_energy, call_grease_energy
from ..core.jit import jit

SIDE, BEGIN, V_IN, PEAK, IMPULSE, LOST = range(6)


class BushingEnergies(NamedTuple):
    """What grease and contacts do in consecutive steps, J and N."""

    film: np.ndarray  # (m, n_bushings) lost in a step
    contact_loss: np.ndarray  # (m, n_bushings) lost in a step
    hysteresis: np.ndarray  # (m, n_bushings) lost in a step
    law_work: np.ndarray  # (m, n_bushings) put in in a step
    in_grease: np.ndarray  # (m, n_bushings) stored
    in_contact: np.ndarray  # (m, n_bushings) stored
    push: np.ndarray  # (m, 2 n_bushings) force of every bushing end
    loss: np.ndarray  # (m, 2 n_bushings) lost by it in a step


@jit
def bushing_energies(
    steps: int, x: np.ndarray, speed: np.ndarray, impact: np.ndarray, clearance: Clearance, found: BushingEnergies
) -> None:
    """Find what bushings do in consecutive steps, of which x begins one step early and ends one late."""
    bushings, states, numbers = clearance
    film, contact_loss, hysteresis, law_work, in_grease, in_contact, pushes, losses = found
    n, earlier = bushings.size, np.empty_like(numbers)
    for i in range(impact.shape[0]):
        numbers[: 2 * n] = impact[i]
        earlier[:] = numbers
        for j in range(n):
            bushing, state, middle = bushings[j], states[j], x[i + 1, j]
            _, c = grease_step(bushing, state, numbers, middle)
            film[i, j] = c * speed[i, j] * (x[i + 2, j] - x[i, j]) / 2
            grease, before, after = at(numbers, bushing.grease), at(earlier, state.grease), at(numbers, state.grease)
            out, dx = at(numbers, state.out), middle - x[i, j]
            call_grease_energy(bushing.grease_energy, grease, before, after, middle + bushing.offset, dx, out)
            in_grease[i, j] = numbers[state.out] - bushing.held - bushing.preload * middle
            hysteresis[i, j] = numbers[state.out + 1]
            follow_law(bushing, state, numbers, middle, (steps + i) * bushing.step)
            now, was, energy = at(numbers, state.contact), at(earlier, state.contact), bushing.contact_energy
            for end in range(2):  # each carries half of the bushing's stiffness and damping
                p = n + 2 * j + end
                g, k, c = contact_step(bushing, state, numbers, end, x[i + 1, p], speed[i, p], False)
                if g == 0.0:
                    continue
                depth, side = abs(g), np.sign(g)
                common = np.sqrt(max(g * signed_penetration(x[i, p], bushing.lower, bushing.upper), 0.0))
                law_work[i, j] += (
                    call_contact_energy(energy, now, common) - call_contact_energy(energy, was, common)
                ) / 2
                in_contact[i, j] += call_contact_energy(energy, now, depth) / 2
                push = contact_force(k, c, depth, side * speed[i, p], bushing.adhesion)
                loss = (push - k * depth) * side * (x[i + 2, p] - x[i, p]) / 2
                pushes[i, 2 * j + end], losses[i, 2 * j + end] = push, loss
                contact_loss[i, j] += loss


@jit
def follow_impacts(
    steps: int, h: float, x: np.ndarray, found: BushingEnergies, walls: np.ndarray, visits: np.ndarray, rows: np.ndarray
) -> int:
    """Follow every bushing end through consecutive steps, of which x begins one early; return the number of ``rows``.

    ``walls``: (n_bushings, 2) displacements at which the lower and the upper one are met.

    ``visits``: each end's visit to a wall so far, with side 0 in the gap.
    """
    count = 0
    for i in range(found.push.shape[0]):
        for end in range(x.shape[1]):
            visit, was, now = visits[end], x[i, end], x[i + 1, end]
            side = visit[SIDE] if visit[SIDE] else np.sign(now)
            d = walls[end // 2, 1] if side > 0.0 else -walls[end // 2, 0]
            # Signed depths; time and speed of the passage from one to the other are those of a straight line.
            was, now = side * was - d, side * now - d
            if now > 0.0 and visit[SIDE] == 0.0:
                visit[SIDE], visit[BEGIN], visit[V_IN] = side, (steps + i - now / (now - was)) * h, (now - was) / h
            elif now <= 0.0 and visit[SIDE]:
                if visit[IMPULSE] > 0.0:
                    duration = (steps + i - now / (now - was)) * h - visit[BEGIN]
                    begun, pushed = (end, side, visit[BEGIN], visit[V_IN]), (visit[PEAK], visit[IMPULSE])
                    rows[count] = np.array((*begun, (was - now) / h, *pushed, duration, visit[LOST]))
                    count += 1
                visit[:] = 0.0
            if visit[SIDE]:
                visit[PEAK] = max(visit[PEAK], found.push[i, end])
                visit[IMPULSE] += found.push[i, end] * h
                visit[LOST] += found.loss[i, end]
    return count
