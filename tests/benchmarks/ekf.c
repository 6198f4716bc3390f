/* An extended Kalman filter without process noise, as fast as C has it: the state at the reference time is
   carried, each bearing is one scalar update, and the runs lie beside one another, so that a compiler makes
   vectors of them.

   Bearings of one time are one update: all are linearised where the first is (`joint` is zero for it, one for
   the others), and taken one after the other. They are in order of time; `measured` is (bearings, runs), `state` (4, runs), `covariance` (10, runs):
   the upper triangle. `sound` is positive for a bearing that arrives late, zero for one that arrives at once. */

#include <math.h>

#define TURN 6.283185307179586
#define BLOCK 64

static void update(int runs, double joint, double x, double y, double s, double sound, double variance,
                   const double *measured, double state[4][BLOCK], double at[4][BLOCK], double p[10][BLOCK])
{
    if (joint == 0)
        for (int i = 0; i < 4; i++)
            for (int r = 0; r < runs; r++) at[i][r] = state[i][r];
#pragma omp simd
    for (int r = 0; r < runs; r++) {
        double vx = at[2][r], vy = at[3][r];
        double dx = at[0][r] + s * vx - x, dy = at[1][r] + s * vy - y, a, b, since = s;
        if (sound > 0) {
            double radial = vx * dx + vy * dy, slack = sound * sound - vx * vx - vy * vy;
            double tau = (sqrt(radial * radial + slack * (dx * dx + dy * dy)) - radial) / slack;
            double scale = 1 / (sound * tau);
            dx -= tau * vx;
            dy -= tau * vy;
            double sine = dx * scale, cosine = dy * scale;
            double turn = (vy * sine - vx * cosine) / (sound + vx * sine + vy * cosine);
            a = (cosine + turn * sine) * scale;
            b = (turn * cosine - sine) * scale;
            since -= tau;
        } else {
            double scale = 1 / (dx * dx + dy * dy);
            a = dy * scale;
            b = -dx * scale;
        }
        double c = since * a, d = since * b, e = measured[r] - atan2(dx, dy);
        e -= TURN * rint(e / TURN);
        e -= a * (state[0][r] - at[0][r]) + b * (state[1][r] - at[1][r]);
        e -= c * (state[2][r] - vx) + d * (state[3][r] - vy);
        double k0 = p[0][r] * a + p[1][r] * b + p[2][r] * c + p[3][r] * d;
        double k1 = p[1][r] * a + p[4][r] * b + p[5][r] * c + p[6][r] * d;
        double k2 = p[2][r] * a + p[5][r] * b + p[7][r] * c + p[8][r] * d;
        double k3 = p[3][r] * a + p[6][r] * b + p[8][r] * c + p[9][r] * d;
        double gain = 1 / (a * k0 + b * k1 + c * k2 + d * k3 + variance), step = gain * e;
        state[0][r] += k0 * step; state[1][r] += k1 * step; state[2][r] += k2 * step; state[3][r] += k3 * step;
        p[0][r] -= gain * k0 * k0; p[1][r] -= gain * k0 * k1; p[2][r] -= gain * k0 * k2;
        p[3][r] -= gain * k0 * k3; p[4][r] -= gain * k1 * k1; p[5][r] -= gain * k1 * k2;
        p[6][r] -= gain * k1 * k3; p[7][r] -= gain * k2 * k2; p[8][r] -= gain * k2 * k3;
        p[9][r] -= gain * k3 * k3;
    }
}

void ekf(int runs, int bearings, const double *joint, const double *x, const double *y, const double *s, const double *sound,
         const double *variance, const double *measured, double *state, double *covariance)
{
    for (int first = 0; first < runs; first += BLOCK) {
        int count = runs - first < BLOCK ? runs - first : BLOCK;
        double here[4][BLOCK], at[4][BLOCK], p[10][BLOCK];
        for (int i = 0; i < 4; i++)
            for (int r = 0; r < count; r++) here[i][r] = state[(long)i * runs + first + r];
        for (int i = 0; i < 10; i++)
            for (int r = 0; r < count; r++) p[i][r] = covariance[(long)i * runs + first + r];
        for (int k = 0; k < bearings; k++)
            update(count, joint[k], x[k], y[k], s[k], sound[k], variance[k], measured + (long)k * runs + first,
                   here, at, p);
        for (int i = 0; i < 4; i++)
            for (int r = 0; r < count; r++) state[(long)i * runs + first + r] = here[i][r];
        for (int i = 0; i < 10; i++)
            for (int r = 0; r < count; r++) covariance[(long)i * runs + first + r] = p[i][r];
    }
}
