/* FPUT alpha+beta chain of unit masses with fixed ends, plain loops: what lattices compete with.
 *
 * stoermer_verlet: kicks and drifts of the leapfrog, momenta at half steps in between.
 * midpoint: implicit midpoint, two Newton corrections a step from the last velocity, each by the
 * algorithm of Thomas; work has 2 n entries. Sites 0 and n-1 do not move.
 */
static double force(double r, double alpha, double beta)
{
    return r + alpha * r * r + beta * r * r * r;
}

static double slope(double r, double alpha, double beta)
{
    return 1 + 2 * alpha * r + 3 * beta * r * r;
}

void stoermer_verlet(long n, long steps, double h, double alpha, double beta,
                     double *restrict x, double *restrict p)
{
    for (long i = 1; i < n - 1; i++)
        p[i] += h / 2 * (force(x[i + 1] - x[i], alpha, beta) - force(x[i] - x[i - 1], alpha, beta));
    for (long k = 0; k < steps; k++) {
        for (long i = 1; i < n - 1; i++)
            x[i] += h * p[i];
        for (long i = 1; i < n - 1; i++)
            p[i] += h * (force(x[i + 1] - x[i], alpha, beta) - force(x[i] - x[i - 1], alpha, beta));
    }
    for (long i = 1; i < n - 1; i++)
        p[i] -= h / 2 * (force(x[i + 1] - x[i], alpha, beta) - force(x[i] - x[i - 1], alpha, beta));
}

void midpoint(long n, long steps, double h, double alpha, double beta,
              double *restrict x, double *restrict p, double *restrict u, double *restrict work)
{
    double *c = work, *g = work + n;
    for (long k = 0; k < steps; k++) {
        for (int newton = 0; newton < 2; newton++) {
            double last_c = 0, last_g = 0;
            double r = x[1] - x[0] + h / 2 * (u[1] - u[0]);
            double f = force(r, alpha, beta), s = slope(r, alpha, beta);
            for (long i = 1; i < n - 1; i++) {
                double ahead = x[i + 1] - x[i] + h / 2 * (u[i + 1] - u[i]);
                double fa = force(ahead, alpha, beta), sa = slope(ahead, alpha, beta);
                double rest = p[i] - u[i] + h / 2 * (fa - f);
                double lower = -h * h / 4 * s, upper = -h * h / 4 * sa;
                double over = 1 / (1 - lower - upper - lower * last_c);
                c[i] = last_c = upper * over;
                g[i] = last_g = (rest - lower * last_g) * over;
                f = fa, s = sa;
            }
            double next = 0;
            for (long i = n - 2; i > 0; i--) {
                next = g[i] - c[i] * next;
                u[i] += next;
            }
        }
        double r = x[1] - x[0] + h / 2 * (u[1] - u[0]), f = force(r, alpha, beta);
        for (long i = 1; i < n - 1; i++) {
            double ahead = x[i + 1] - x[i] + h / 2 * (u[i + 1] - u[i]);
            double fa = force(ahead, alpha, beta);
            p[i] += h * (fa - f);
            x[i] += h * u[i];
            f = fa;
        }
    }
}
