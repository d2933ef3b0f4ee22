"""The polar Hermite surface of bends, compiled: Kwok 2013, eq. 21-23 with all partial derivatives.

Between two control angles Θ(ϑ) is a cubic in ϑ − ϑ_i, kept as its four coefficients. In r the Hermite form of (23) is
Q = w_0 q(0, 0) + w_1 Θ(ϑ) + w_2 Θ(ϑ + π) with polynomials w in r, whose sum is 1.
"""

from __future__ import annotations

import math

from ...arrays import Array
from ...kernels.compiled import no_refcount

VALUE, BY_R, BY_THETA, BY_RR, BY_R_THETA, BY_THETA_THETA = range(6)  # rows of what ``hermite_polar`` fills


@no_refcount
def interval(knots: Array, theta: float) -> tuple[int, float]:
    """The interval i of (21) that contains an angle, the last one extending to the first, and ϑ − ϑ_i."""
    x = (theta - knots[0]) % (2.0 * math.pi)
    i = 0
    while i + 1 < len(knots) and knots[i + 1] - knots[0] <= x:
        i += 1
    return i, x - (knots[i] - knots[0])


@no_refcount
def hermite_polar(knots: Array, coefficients: Array, rest: Array, r: float, theta: float, out: Array) -> None:
    """Q(r, ϑ), its first and its second partial derivatives.

    Args:
        knots: (c,) the control angles ϑ_i, rad, increasing within one turn; coefficients: (c, 4, n) of Θ from ϑ_i on;
        rest: (n,) q(0, 0); r: linear beyond 1, and −r is r at ϑ + π.
        out: (6, n), rows as named above.
    """
    back = 1.0
    if r < 0.0:  # Q(−r, ϑ) = Q(r, ϑ + π): C¹ along a diameter
        r, theta, back = -r, theta + math.pi, -1.0
    i, t = interval(knots, theta)
    j, s = interval(knots, theta + math.pi)
    # (23): h00 q + h10 ½(Θ(ϑ) − Θ(ϑ + π)) + h01 Θ(ϑ) + h11 (Θ(ϑ) − q), sorted by what is multiplied
    w0, w1, w2 = 1.0 + r * r * (r - 2.0), r * (0.5 + r * (1.0 - 0.5 * r)), -0.5 * r * (1.0 - r) * (1.0 - r)
    d0, d1, d2 = r * (3.0 * r - 4.0), 0.5 + r * (2.0 - 1.5 * r), -0.5 * (1.0 - r) * (1.0 - 3.0 * r)
    e0, e1, e2 = 6.0 * r - 4.0, 2.0 - 3.0 * r, 2.0 - 3.0 * r
    if r > 1.0:  # linear with the slope Θ − q(0, 0); the cubic would turn back
        w0, w1, w2 = 1.0 - r, r, 0.0
        d0, d1, d2 = -1.0, 1.0, 0.0
        e0, e1, e2 = 0.0, 0.0, 0.0
    for k in range(len(rest)):
        a0, a1, a2, a3 = coefficients[i, 0, k], coefficients[i, 1, k], coefficients[i, 2, k], coefficients[i, 3, k]
        b0, b1, b2, b3 = coefficients[j, 0, k], coefficients[j, 1, k], coefficients[j, 2, k], coefficients[j, 3, k]
        here, there = a0 + t * (a1 + t * (a2 + t * a3)), b0 + s * (b1 + s * (b2 + s * b3))
        here_1, there_1 = a1 + t * (2.0 * a2 + 3.0 * t * a3), b1 + s * (2.0 * b2 + 3.0 * s * b3)
        here_2, there_2 = 2.0 * a2 + 6.0 * t * a3, 2.0 * b2 + 6.0 * s * b3
        out[0, k] = w0 * rest[k] + w1 * here + w2 * there
        out[1, k] = back * (d0 * rest[k] + d1 * here + d2 * there)
        out[2, k] = w1 * here_1 + w2 * there_1
        out[3, k] = e0 * rest[k] + e1 * here + e2 * there
        out[4, k] = back * (d1 * here_1 + d2 * there_1)
        out[5, k] = w1 * here_2 + w2 * there_2


@no_refcount
def hermite_cartesian(knots: Array, coefficients: Array, rest: Array, u: float, v: float, out: Array) -> None:
    """Q at (u, v) = r (cos ϑ, sin ϑ), ∂Q/∂u and ∂Q/∂v into ``out`` (3, n), finite everywhere; the rest as above.

    ∂Q/∂u = cos ϑ Q_r − sin ϑ Q_ϑ/r and ∂Q/∂v = sin ϑ Q_r + cos ϑ Q_ϑ/r, where r divides Q_ϑ without a remainder. At 0
    they are the slopes of the two axes, ½(Θ(0) − Θ(π)) and ½(Θ(π/2) − Θ(3π/2)).
    """
    r = math.sqrt(u * u + v * v)
    if r == 0.0:
        i, t = interval(knots, 0.0)
        j, s = interval(knots, math.pi)
        ii, tt = interval(knots, 0.5 * math.pi)
        jj, ss = interval(knots, 1.5 * math.pi)
        for k in range(len(rest)):
            out[0, k] = rest[k]
            out[1, k] = 0.5 * (cubic(coefficients, i, k, t) - cubic(coefficients, j, k, s))
            out[2, k] = 0.5 * (cubic(coefficients, ii, k, tt) - cubic(coefficients, jj, k, ss))
        return
    theta, c, n = math.atan2(v, u), u / r, v / r
    i, t = interval(knots, theta)
    j, s = interval(knots, theta + math.pi)
    w0, w1, w2 = 1.0 + r * r * (r - 2.0), 0.5 + r * (1.0 - 0.5 * r), -0.5 * (1.0 - r) * (1.0 - r)  # w1, w2 over r
    d0, d1, d2 = r * (3.0 * r - 4.0), 0.5 + r * (2.0 - 1.5 * r), -0.5 * (1.0 - r) * (1.0 - 3.0 * r)
    if r > 1.0:
        w0, w1, w2 = 1.0 - r, 1.0, 0.0
        d0, d1, d2 = -1.0, 1.0, 0.0
    for k in range(len(rest)):
        here, there = cubic(coefficients, i, k, t), cubic(coefficients, j, k, s)
        here_1 = coefficients[i, 1, k] + t * (2.0 * coefficients[i, 2, k] + 3.0 * t * coefficients[i, 3, k])
        there_1 = coefficients[j, 1, k] + s * (2.0 * coefficients[j, 2, k] + 3.0 * s * coefficients[j, 3, k])
        outwards = d0 * rest[k] + d1 * here + d2 * there
        across = w1 * here_1 + w2 * there_1
        out[0, k] = w0 * rest[k] + r * (w1 * here + w2 * there)
        out[1, k] = c * outwards - n * across
        out[2, k] = n * outwards + c * across


@no_refcount
def cubic(coefficients: Array, i: int, k: int, t: float) -> float:
    """Θ_k in the interval i, t rad after its beginning."""
    value: float = coefficients[i, 0, k] + t * (
        coefficients[i, 1, k] + t * (coefficients[i, 2, k] + t * coefficients[i, 3, k])
    )
    return value
