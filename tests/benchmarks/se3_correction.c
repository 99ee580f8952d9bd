/* Newton corrections of a free body on SE(3), Cayley: F(u) = A(hu)ᵀ G u against μ.
 *
 * A(ξ)η = (1 − ξ/2) η (1 + ξ/2) is the inverse tangent map of the Cayley transform (Hairer, Lubich,
 * Wanner, IV.8.3). state: μ, w, the correction (six numbers each); each correction starts from w
 * and a little of the one before, so none can be left out. */

static const double J[3] = {1, 2, 3}, M[3] = {2, 1.5, 1}, D = 0.2;

static void hat(const double *a, double m[3][3]) {
    m[0][0] = m[1][1] = m[2][2] = 0;
    m[0][1] = -a[2]; m[0][2] = a[1]; m[1][2] = -a[0];
    m[1][0] = a[2]; m[2][0] = -a[1]; m[2][1] = a[0];
}

static void correction(const double *mu, const double *u, double h, double *du) {
    double p[6], x[6], A[6][6] = {{0}}, N[6][6] = {{0}}, K[6][7];
    double w[3][3], v[3][3], m[3][3], f[3][3], vw[3][3], vf[3][3], turned[3], t[3][3];
    for (int i = 0; i < 3; i++) {
        p[i] = J[i] * u[i] + D * u[3 + i];
        p[3 + i] = M[i] * u[3 + i] + D * u[i];
        x[i] = h * u[i];
        x[3 + i] = h * u[3 + i];
    }
    hat(x, w); hat(x + 3, v); hat(p, m); hat(p + 3, f);
    double dot = x[0] * p[0] + x[1] * p[1] + x[2] * p[2];
    for (int i = 0; i < 3; i++) {
        turned[i] = 0;
        for (int j = 0; j < 3; j++) {
            turned[i] += w[i][j] * p[3 + j];
            vw[i][j] = vf[i][j] = 0;
            for (int k = 0; k < 3; k++) {
                vw[i][j] += v[i][k] * w[k][j];
                vf[i][j] += v[i][k] * f[k][j];
            }
        }
    }
    hat(turned, t);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double one = i == j;
            A[i][j] = one + w[i][j] / 2 + x[i] * x[j] / 4;
            A[i][3 + j] = v[i][j] / 2 + vw[i][j] / 4;
            A[3 + i][3 + j] = one + w[i][j] / 2;
            N[i][j] = -m[i][j] / 2 + (dot * one + x[i] * p[j]) / 4 - vf[i][j] / 4;
            N[i][3 + j] = -f[i][j] / 2 - t[i][j] / 4;
            N[3 + i][j] = -f[i][j] / 2;
        }
    for (int i = 0; i < 6; i++) {
        K[i][6] = mu[i];
        for (int j = 0; j < 3; j++) {
            K[i][j] = A[i][j] * J[j] + A[i][3 + j] * D + h * N[i][j];
            K[i][3 + j] = A[i][3 + j] * M[j] + A[i][j] * D + h * N[i][3 + j];
        }
        for (int j = 0; j < 6; j++) K[i][6] -= A[i][j] * p[j];
    }
    for (int q = 0; q < 6; q++) {
        double over = 1 / K[q][q];
        for (int i = q + 1; i < 6; i++) {
            double factor = K[i][q] * over;
            for (int j = q + 1; j < 7; j++) K[i][j] -= factor * K[q][j];
        }
    }
    for (int q = 5; q >= 0; q--) {
        double rest = K[q][6];
        for (int j = q + 1; j < 6; j++) rest -= K[q][j] * du[j];
        du[q] = rest / K[q][q];
    }
}

void se3_correction(long steps, double h, double *state) {
    double u[6];
    for (int i = 12; i < 18; i++) state[i] = 0;
    for (long s = 0; s < steps; s++) {
        for (int i = 0; i < 6; i++) u[i] = state[6 + i] + 1e-3 * state[12 + i];
        correction(state, u, h, state + 12);
    }
}
