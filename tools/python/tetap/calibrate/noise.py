# SPDX-License-Identifier: Apache-2.0
"""The error of a series of GNSS fixes along a drive: from fix to fix, slowly wandering, and what the wheels' own random walk adds.

Variance s_w^2 I + s_c^2 exp(-|dt|/tau) + k * path; its numbers by restricted maximum likelihood (D. A. Harville, JASA 72, 1977), because a
likelihood of the residuals alone takes what the unknowns swallowed for accuracy.
"""
import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

TUNE_FIXES = 200          # for the noise's own numbers


class Noise:
    """s_w^2 I + s_c^2 exp(-|dt|/tau) + path part; tuned by restricted likelihood, with a weak prior at the receiver's own figure."""

    def __init__(self, t, path, path_noise, accuracy, tau_s):
        self.t, self.path = t, path
        self.accuracy, self.tau0, self.walk0 = accuracy, tau_s, path_noise  # prior before the residuals
        self.found = np.array([accuracy / np.sqrt(2), accuracy / np.sqrt(2), tau_s] + ([path_noise] if path_noise else []))

    @property
    def white(self):
        return float(self.found[0])

    @property
    def slow(self):
        return float(self.found[1])

    @property
    def tau(self):
        return float(self.found[2])

    def only(self, rows):
        """The same noise at some of the fixes."""
        one = Noise.__new__(Noise)
        one.__dict__.update(self.__dict__)
        one.t, one.path = self.t[rows], self.path[rows]
        return one

    def matrix(self, rows, white, slow, tau, walk=0.0):
        t, path = self.t[rows], self.path[rows]
        c = slow**2 * np.exp(-np.abs(t[:, None] - t) / tau) + walk * np.minimum(path[:, None], path)
        c[np.diag_indices(len(t))] += white**2
        return c

    def factor(self):
        return np.linalg.cholesky(self.matrix(slice(None), *self.found))

    def tune(self, residual, jacobian, other):
        """`residual` complex, `jacobian` complex columns; `other`: information of the rest of the data about the unknowns."""
        rows = np.arange(0, len(self.t), max(1, -(-len(self.t) // TUNE_FIXES)))
        r = np.stack([residual[rows].real, residual[rows].imag], axis=1)
        j = np.hstack([jacobian[rows].real, jacobian[rows].imag])
        columns = jacobian.shape[1]

        def cost(logs):
            white, slow, tau, *walk = np.exp(logs)
            try:
                factor = cho_factor(self.matrix(rows, white, slow, tau, *walk), lower=True)
            except np.linalg.LinAlgError:
                return 1e12
            solved = cho_solve(factor, r)
            solved_j = cho_solve(factor, j)
            information = other + j[:, :columns].T @ solved_j[:, :columns] + j[:, columns:].T @ solved_j[:, columns:]
            sign, logdet = np.linalg.slogdet(information)
            if sign <= 0:
                return 1e12
            value = 2 * 2 * np.log(np.diag(factor[0])).sum() + (r * solved).sum() + logdet
            value += (np.log(np.hypot(white, slow) / self.accuracy) / 0.5) ** 2 + np.log(tau / self.tau0) ** 2 + (np.log(slow / white) / 2.0) ** 2
            return value + sum((np.log(one / self.walk0) / 1.5) ** 2 for one in walk)

        start = np.log(self.found)
        simplex = np.vstack([start, start + np.diag([0.4, 0.4, 0.5, 1.5][:len(start)])])
        found = minimize(cost, start, method="Nelder-Mead", options={"maxfev": 120, "xatol": 0.02, "fatol": 0.05, "initial_simplex": simplex})
        self.found = np.exp(found.x)
