/* The heavy top of heavy_top.c with every trick: Newton starts from the extrapolation of the last
   five solutions, stops as soon as what is left is below round-off by the quadratic estimate (one
   correction a step, with kappa seen in every sixteenth step), constants are folded, products of u
   shared, p = I u and the residual kept for the update. To be compiled with -O3 -march=native
   -ffast-math. No compensated sums, no test for failure. state: x[3], mu[3], u[3]. */
#include <math.h>

static const double I0 = 1, I1 = 2, I2 = 3, E0 = 2.0 / 3, E1 = 1.0 / 3, E2 = 2.0 / 3;

long heavy_top_tricks(long steps, double h, double *state)
{
    double x0 = state[0], x1 = state[1], x2 = state[2];
    double n0 = state[3], n1 = state[4], n2 = state[5];
    double u0 = state[6], u1 = state[7], u2 = state[8];
    /* differences of the past solutions: the extrapolation is u + d + dd + ddd + dddd */
    double v0 = u0, v1 = u1, v2 = u2, w0 = u0, w1 = u1, w2 = u2, y0 = u0, y1 = u1, y2 = u2;
    double z0 = u0, z1 = u1, z2 = u2;
    const double a = h / 2, b = a * a, aE0 = a * E0, aE1 = a * E1, aE2 = a * E2;
    const double a10 = a * (I1 - I0), a21 = a * (I2 - I1), a02 = a * (I0 - I2);
    const double b0 = b * I0, b1 = b * I1, b2 = b * I2, eps = 1.0 / 9007199254740992.0;
    double kappa = 1;
    long corrections = 0;
    for (long k = 0; k < steps; k++) {
        /* half of the torque at the start: enters the residual now and the update below */
        const double g0 = aE1 * x2 - aE2 * x1, g1 = aE2 * x0 - aE0 * x2, g2 = aE0 * x1 - aE1 * x0;
        const double r0 = n0 - g0, r1 = n1 - g1, r2 = n2 - g2;
        double s0 = 5 * (u0 - y0) + 10 * (w0 - v0) + z0;
        double s1 = 5 * (u1 - y1) + 10 * (w1 - v1) + z1;
        double s2 = 5 * (u2 - y2) + 10 * (w2 - v2) + z2;
        if (k < 6)
            s0 = u0, s1 = u1, s2 = u2;
        double before = 0;
        z0 = y0, z1 = y1, z2 = y2, y0 = w0, y1 = w1, y2 = w2;
        w0 = v0, w1 = v1, w2 = v2, v0 = u0, v1 = u1, v2 = u2;
        for (int iteration = 0; iteration < 30; iteration++) {
            const double q00 = s0 * s0, q11 = s1 * s1, q22 = s2 * s2;
            const double up = b0 * q00 + b1 * q11 + b2 * q22;
            const double d0 = I0 + up, d1 = I1 + up, d2 = I2 + up;
            const double m12 = a21 * s1, m20 = a02 * s2, m01 = a10 * s0;
            const double f0 = r0 - s0 * d0 - a21 * s1 * s2;
            const double f1 = r1 - s1 * d1 - a02 * s0 * s2;
            const double f2 = r2 - s2 * d2 - a10 * s0 * s1;
            const double t0 = 2 * s0, t1 = 2 * s1, t2 = 2 * s2;
            const double p0 = b0 * t0, p1 = b1 * t1, p2 = b2 * t2;
            const double j00 = d0 + s0 * p0, j11 = d1 + s1 * p1, j22 = d2 + s2 * p2;
            const double j01 = s0 * p1 + a21 * s2, j02 = s0 * p2 + m12;
            const double j10 = s1 * p0 + m20, j12 = s1 * p2 + a02 * s0;
            const double j20 = s2 * p0 + a10 * s1, j21 = s2 * p1 + m01;
            const double c00 = j11 * j22 - j12 * j21, c10 = j12 * j20 - j10 * j22;
            const double c20 = j10 * j21 - j11 * j20;
            const double over = 1 / (j00 * c00 + j01 * c10 + j02 * c20);
            const double e0 = over * (c00 * f0 + (j02 * j21 - j01 * j22) * f1
                                      + (j01 * j12 - j02 * j11) * f2);
            const double e1 = over * (c10 * f0 + (j00 * j22 - j02 * j20) * f1
                                      + (j02 * j10 - j00 * j12) * f2);
            const double e2 = over * (c20 * f0 + (j01 * j20 - j00 * j21) * f1
                                      + (j00 * j11 - j01 * j10) * f2);
            s0 += e0, s1 += e1, s2 += e2;
            corrections++;
            const double size = fabs(e0) + fabs(e1) + fabs(e2);
            const double noise = eps * (fabs(s0) + fabs(s1) + fabs(s2));
            if (iteration == 1 && size > 64 * noise)
                kappa = size / (before * before);
            before = size;
            if (size <= noise || (8 * kappa * size * size <= noise && (iteration || k % 16)))
                break;
        }
        u0 = s0, u1 = s1, u2 = s2;
        const double sc = h / (1 + b * (u0 * u0 + u1 * u1 + u2 * u2)), sa = sc * a;
        const double c0 = x1 * u2 - x2 * u1, c1 = x2 * u0 - x0 * u2, c2 = x0 * u1 - x1 * u0;
        const double dx0 = sc * c0 + sa * (c1 * u2 - c2 * u1);
        const double dx1 = sc * c1 + sa * (c2 * u0 - c0 * u2);
        const double dx2 = sc * c2 + sa * (c0 * u1 - c1 * u0);
        x0 += dx0, x1 += dx1, x2 += dx2;
        n0 -= 2 * a21 * u1 * u2 + g0 + aE1 * x2 - aE2 * x1;
        n1 -= 2 * a02 * u0 * u2 + g1 + aE2 * x0 - aE0 * x2;
        n2 -= 2 * a10 * u0 * u1 + g2 + aE0 * x1 - aE1 * x0;
    }
    state[0] = x0, state[1] = x1, state[2] = x2;
    state[3] = n0, state[4] = n1, state[5] = n2;
    state[6] = u0, state[7] = u1, state[8] = u2;
    return corrections;
}
