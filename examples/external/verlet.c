/* Störmer–Verlet for the scenes pendulum and kepler, asked by JSON lines.  cc -O2 -o verlet verlet.c -lm */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char line[65536];
static double inertia, weight; /* m l^2 and m g l; of kepler 1 and the strength */

static const char *after(const char *key) { /* what follows "key": in the line */
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *found = strstr(line, quoted);
    return found ? found + strlen(quoted) : "";
}

static void force(const double *q, double *f, int n) {
    if (n == 1) {
        f[0] = -weight * sin(q[0]);
    } else {
        double r = hypot(q[0], q[1]);
        f[0] = -weight * q[0] / (r * r * r);
        f[1] = -weight * q[1] / (r * r * r);
    }
}

static void rows(const char *key, const double *values, long count, int n) {
    printf("\"%s\": [", key);
    for (long i = 0; i < count; i++) {
        printf(i ? ", [%.17g" : "[%.17g", values[i * n]);
        if (n == 2) printf(", %.17g", values[i * n + 1]);
        printf("]");
    }
    printf("]");
}

int main(void) {
    while (fgets(line, sizeof line, stdin)) {
        int n = strncmp(after("scene"), "\"kepler\"", 8) ? 1 : 2;
        if (n == 1 && strncmp(after("scene"), "\"pendulum\"", 10)) {
            printf("{\"error\": \"I know the scenes pendulum and kepler only\"}\n");
            fflush(stdout);
            continue;
        }
        double q[2], p[2], f[2], h = atof(after("h")), l = atof(after("length"));
        sscanf(after("x"), "[%lf, %lf", &q[0], &q[1]);
        sscanf(after("mu"), "[%lf, %lf", &p[0], &p[1]);
        inertia = n == 1 ? atof(after("mass")) * l * l : 1;
        weight = n == 1 ? atof(after("mass")) * atof(after("gravity")) * l : atof(after("strength"));
        long steps = atol(after("steps")), every = atol(after("every")), count = steps / every + 1;
        double *x = malloc(count * n * sizeof *x), *mu = malloc(count * n * sizeof *mu);
        for (long k = 0;; k++) {
            if (k % every == 0) {
                memcpy(x + k / every * n, q, n * sizeof *q);
                memcpy(mu + k / every * n, p, n * sizeof *p);
            }
            if (k == steps) break;
            force(q, f, n);
            for (int i = 0; i < n; i++) q[i] += h * (p[i] += h / 2 * f[i]) / inertia;
            force(q, f, n);
            for (int i = 0; i < n; i++) p[i] += h / 2 * f[i];
        }
        printf("{"), rows("x", x, count, n), printf(", "), rows("mu", mu, count, n), printf("}\n");
        fflush(stdout); /* an answer must not wait in a buffer */
        free(x), free(mu);
    }
    return 0;
}
