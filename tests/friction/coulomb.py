"""Coulomb's law written out densely, and all its answers by trying every state of every contact."""

from itertools import product

import numpy as np

OPEN, STICK, FORWARD, BACKWARD = range(4)


class Dense:
    """M, rows N and T of all contacts for u = (u₁x, u₁y, ω₁, …), and u⁻."""

    def __init__(self, snapshot, contacts, left):
        n, k = len(snapshot), len(contacts)
        self.mass = np.repeat(snapshot.mass, 3)
        self.mass[2::3] = 0.5 * snapshot.mass * snapshot.radius**2
        self.left = np.zeros(3 * n)
        self.left[0::3], self.left[1::3] = left.T
        self.left[2::3] = snapshot.spin
        self.N, self.T = np.zeros((k, 3 * n)), np.zeros((k, 3 * n))
        for c in range(k):
            nx, ny = contacts.normal[c]
            i = contacts.first[c]
            # the point of the first body is at +r n of its centre: it moves with u + ω × r n
            self.N[c, 3 * i : 3 * i + 2] = nx, ny
            self.T[c, 3 * i : 3 * i + 3] = -ny, nx, snapshot.radius[i]
            if not contacts.is_wall[c]:
                j = contacts.second[c]
                self.N[c, 3 * j : 3 * j + 2] = -nx, -ny
                self.T[c, 3 * j : 3 * j + 3] = ny, -nx, snapshot.radius[j]

    def balance(self, lam, tau, u):
        """M(u − u⁻) + Nᵀλ + Tᵀτ."""
        return self.mass * (u - self.left) + self.N.T @ lam + self.T.T @ tau

    def after(self, lam, tau):
        """The velocities that balance percussions."""
        return self.left - (self.N.T @ lam + self.T.T @ tau) / self.mass


def violation(dense, lam, tau, friction, u):
    """How far λ, τ, u are from the law, condition by condition, m/s and N·s: the largest."""
    v, s = dense.N @ u, dense.T @ u
    maximum = friction * lam
    return max(
        v.max(initial=0.0),
        -lam.min(initial=0.0),
        np.abs(lam * v).max(initial=0.0),
        (np.abs(tau) - maximum).max(initial=0.0),
        np.abs(maximum * np.abs(s) - tau * s).max(initial=0.0),
        np.abs(dense.balance(lam, tau, u)).max(initial=0.0),
    )


def velocities(found):
    """u⁺ (3n,) of an answer, spins included."""
    return np.column_stack([found.right_velocity, found.right_spin]).ravel()


def all_answers(dense, friction, allowed=1e-9):
    """The u⁺ of every state of the contacts that obeys the law; and whether one was left out
    because its equations are singular."""
    k = len(friction)
    minv = 1.0 / dense.mass
    solutions, singular = [], False
    for states in product(range(4), repeat=k):
        states = np.array(states)
        closed, stuck = states != OPEN, states == STICK
        way = np.where(states == FORWARD, 1.0, np.where(states == BACKWARD, -1.0, 0.0))
        pushes = dense.N[closed] + (way * friction)[closed, None] * dense.T[closed]
        forces = np.vstack([pushes, dense.T[stuck]])
        rows = np.vstack([dense.N[closed], dense.T[stuck]])
        matrix = rows @ (minv[:, None] * forces.T)
        if len(matrix) and np.linalg.cond(matrix) > 1e10:
            singular = True
            continue
        solved = np.linalg.solve(matrix, rows @ dense.left) if len(matrix) else np.empty(0)
        lam, tau = np.zeros(k), np.zeros(k)
        lam[closed] = solved[: closed.sum()]
        tau[stuck] = solved[closed.sum() :]
        tau += way * friction * lam
        u = dense.after(lam, tau)
        if violation(dense, lam, tau, friction, u) <= allowed * (1.0 + np.abs(lam).max(initial=0)):
            solutions.append(u)
    return solutions, singular
