/* The heavy top on S^2 x so(3), Cayley chart, trapezoidal rule: I = (1, 2, 3), weight 1, centre of
   mass (2/3, 1/3, 2/3). A plain program: in every step F-(x, u) = h mu is solved for u by Newton's
   method from the last u until the correction is below 1e-12; then x and mu are updated.
   state: x[3], mu[3], u[3] (the start of Newton). Returns the number of Newton corrections. */
#include <math.h>

static const double I[3] = {1, 2, 3}, e[3] = {2.0 / 3, 1.0 / 3, 2.0 / 3};

/* F-/h and its derivative by u: R' I u + (h/2) e x Gamma, with R = 1 - (h/2)[u] + (h/2)^2 u u'. */
static void legendre(const double *u, const double *x, double h, double F[3], double J[3][3])
{
    const double a = h / 2, b = a * a;
    const double p[3] = {I[0] * u[0], I[1] * u[1], I[2] * u[2]};
    const double up = u[0] * p[0] + u[1] * p[1] + u[2] * p[2];
    F[0] = p[0] + a * (u[1] * p[2] - u[2] * p[1]) + b * u[0] * up + a * (e[1] * x[2] - e[2] * x[1]);
    F[1] = p[1] + a * (u[2] * p[0] - u[0] * p[2]) + b * u[1] * up + a * (e[2] * x[0] - e[0] * x[2]);
    F[2] = p[2] + a * (u[0] * p[1] - u[1] * p[0]) + b * u[2] * up + a * (e[0] * x[1] - e[1] * x[0]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            J[i][j] = (i == j ? I[i] + b * up : 0) + 2 * b * u[i] * p[j];
    J[0][1] += a * (p[2] - u[2] * I[1]);
    J[0][2] += a * (u[1] * I[2] - p[1]);
    J[1][0] += a * (u[2] * I[0] - p[2]);
    J[1][2] += a * (p[0] - u[0] * I[2]);
    J[2][0] += a * (p[1] - u[1] * I[0]);
    J[2][1] += a * (u[0] * I[1] - p[0]);
}

long heavy_top(long steps, double h, double *state)
{
    double *x = state, *mu = state + 3, *u = state + 6;
    long corrections = 0;
    for (long k = 0; k < steps; k++) {
        for (int iteration = 0; iteration < 30; iteration++) {
            double F[3], J[3][3];
            legendre(u, x, h, F, J);
            const double r0 = mu[0] - F[0], r1 = mu[1] - F[1], r2 = mu[2] - F[2];
            const double m00 = J[1][1] * J[2][2] - J[1][2] * J[2][1];
            const double m10 = J[1][2] * J[2][0] - J[1][0] * J[2][2];
            const double m20 = J[1][0] * J[2][1] - J[1][1] * J[2][0];
            const double m01 = J[0][2] * J[2][1] - J[0][1] * J[2][2];
            const double m11 = J[0][0] * J[2][2] - J[0][2] * J[2][0];
            const double m21 = J[0][1] * J[2][0] - J[0][0] * J[2][1];
            const double m02 = J[0][1] * J[1][2] - J[0][2] * J[1][1];
            const double m12 = J[0][2] * J[1][0] - J[0][0] * J[1][2];
            const double m22 = J[0][0] * J[1][1] - J[0][1] * J[1][0];
            const double over = 1 / (J[0][0] * m00 + J[0][1] * m10 + J[0][2] * m20);
            const double d0 = over * (m00 * r0 + m01 * r1 + m02 * r2);
            const double d1 = over * (m10 * r0 + m11 * r1 + m12 * r2);
            const double d2 = over * (m20 * r0 + m21 * r1 + m22 * r2);
            u[0] += d0;
            u[1] += d1;
            u[2] += d2;
            corrections++;
            if (fabs(d0) + fabs(d1) + fabs(d2) < 1e-12)
                break;
        }
        /* x' = x cay(hu): x + s (x × u + (h/2)(x × u) × u), s = h / (1 + h^2 |u|^2 / 4) */
        const double a = h / 2, s = h / (1 + a * a * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]));
        const double p[3] = {I[0] * u[0], I[1] * u[1], I[2] * u[2]};
        const double v[3] = {x[1] * u[2] - x[2] * u[1], x[2] * u[0] - x[0] * u[2],
                             x[0] * u[1] - x[1] * u[0]};
        const double w[3] = {v[1] * u[2] - v[2] * u[1], v[2] * u[0] - v[0] * u[2],
                             v[0] * u[1] - v[1] * u[0]};
        const double y[3] = {x[0] + s * (v[0] + a * w[0]), x[1] + s * (v[1] + a * w[1]),
                             x[2] + s * (v[2] + a * w[2])};
        const double m[3] = {x[0] + y[0], x[1] + y[1], x[2] + y[2]};
        mu[0] -= h * (u[1] * p[2] - u[2] * p[1]) + a * (e[1] * m[2] - e[2] * m[1]);
        mu[1] -= h * (u[2] * p[0] - u[0] * p[2]) + a * (e[2] * m[0] - e[0] * m[2]);
        mu[2] -= h * (u[0] * p[1] - u[1] * p[0]) + a * (e[0] * m[1] - e[1] * m[0]);
        x[0] = y[0];
        x[1] = y[1];
        x[2] = y[2];
    }
    return corrections;
}
