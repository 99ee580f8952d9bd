/* Störmer–Verlet for the pendulum x'' = -sin x, as one writes it: kick, drift, kick, and one sine
   a step, since the force at the end of a step is the force at the start of the next. */
#include <math.h>

void stormer_verlet(long steps, double h, double *state)
{
    double x = state[0], mu = state[1], s = sin(x);
    for (long k = 0; k < steps; k++) {
        mu -= h / 2 * s;
        x += h * mu;
        s = sin(x);
        mu -= h / 2 * s;
    }
    state[0] = x;
    state[1] = mu;
}
