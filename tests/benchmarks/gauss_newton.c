/* Plain Gauss-Newton for bearings that arrive at once and bearings that arrive late, as fast as C has it.

   A run has `early` bearings of weight `early_weight` (1 / sigma^2), then `late` ones. Times are since the
   reference time; `x` and `y` are the platform's places. The loops have no branches, so that a compiler makes
   vectors of them. */

#include <math.h>

#define SUMS 15 /* criterion, J'e, and the upper triangle of J'J */
#define TURN 6.283185307179586

static void early_sums(int n, const double *x, const double *y, const double *s, const double *measured,
                       const double *state, double weight, double *sums)
{
    double c = 0, g0 = 0, g1 = 0, g2 = 0, g3 = 0;
    double h00 = 0, h01 = 0, h02 = 0, h03 = 0, h11 = 0, h13 = 0, h22 = 0, h23 = 0, h33 = 0, h12 = 0;
#pragma omp simd reduction(+ : c, g0, g1, g2, g3, h00, h01, h02, h03, h11, h12, h13, h22, h23, h33)
    for (int k = 0; k < n; k++) {
        double dx = state[0] + s[k] * state[2] - x[k], dy = state[1] + s[k] * state[3] - y[k];
        double scale = 1 / (dx * dx + dy * dy), a = dy * scale, b = -dx * scale, p = s[k] * a, q = s[k] * b;
        double e = measured[k] - atan2(dx, dy);
        e -= TURN * rint(e / TURN);
        c += e * e; g0 += a * e; g1 += b * e; g2 += p * e; g3 += q * e;
        h00 += a * a; h01 += a * b; h02 += a * p; h03 += a * q; h11 += b * b; h12 += b * p; h13 += b * q;
        h22 += p * p; h23 += p * q; h33 += q * q;
    }
    double all[SUMS] = {c, g0, g1, g2, g3, h00, h01, h02, h03, h11, h12, h13, h22, h23, h33};
    for (int i = 0; i < SUMS; i++) sums[i] += weight * all[i];
}

static void late_sums(int n, const double *x, const double *y, const double *s, const double *measured,
                      const double *state, double weight, double sound, double *sums)
{
    double c = 0, g0 = 0, g1 = 0, g2 = 0, g3 = 0, vx = state[2], vy = state[3];
    double slack = sound * sound - vx * vx - vy * vy;
    double h00 = 0, h01 = 0, h02 = 0, h03 = 0, h11 = 0, h13 = 0, h22 = 0, h23 = 0, h33 = 0, h12 = 0;
#pragma omp simd reduction(+ : c, g0, g1, g2, g3, h00, h01, h02, h03, h11, h12, h13, h22, h23, h33)
    for (int k = 0; k < n; k++) {
        double dx = state[0] + s[k] * vx - x[k], dy = state[1] + s[k] * vy - y[k];
        double radial = vx * dx + vy * dy;
        double tau = (sqrt(radial * radial + slack * (dx * dx + dy * dy)) - radial) / slack;
        double scale = 1 / (sound * tau), since = s[k] - tau;
        dx -= tau * vx;
        dy -= tau * vy;
        double sine = dx * scale, cosine = dy * scale;
        double turn = (vy * sine - vx * cosine) / (sound + vx * sine + vy * cosine);
        double a = (cosine + turn * sine) * scale, b = (turn * cosine - sine) * scale;
        double p = since * a, q = since * b, e = measured[k] - atan2(dx, dy);
        e -= TURN * rint(e / TURN);
        c += e * e; g0 += a * e; g1 += b * e; g2 += p * e; g3 += q * e;
        h00 += a * a; h01 += a * b; h02 += a * p; h03 += a * q; h11 += b * b; h12 += b * p; h13 += b * q;
        h22 += p * p; h23 += p * q; h33 += q * q;
    }
    double all[SUMS] = {c, g0, g1, g2, g3, h00, h01, h02, h03, h11, h12, h13, h22, h23, h33};
    for (int i = 0; i < SUMS; i++) sums[i] += weight * all[i];
}

/* Add the solution of the normal equations, by Cholesky's factors of the matrix with a unit diagonal. */
static void step(const double *sums, double *state)
{
    static const int at[4][4] = {{5, 6, 7, 8}, {6, 9, 10, 11}, {7, 10, 12, 13}, {8, 11, 13, 14}};
    double l[4][4], z[4], scale[4];
    for (int i = 0; i < 4; i++) scale[i] = 1 / sqrt(sums[at[i][i]]);
    for (int i = 0; i < 4; i++)
        for (int j = 0; j <= i; j++) {
            double left = sums[at[i][j]] * scale[i] * scale[j];
            for (int k = 0; k < j; k++) left -= l[i][k] * l[j][k];
            l[i][j] = i == j ? sqrt(left) : left / l[j][j];
        }
    for (int i = 0; i < 4; i++) {
        z[i] = sums[1 + i] * scale[i];
        for (int k = 0; k < i; k++) z[i] -= l[i][k] * z[k];
        z[i] /= l[i][i];
    }
    for (int i = 3; i >= 0; i--) {
        for (int k = i + 1; k < 4; k++) z[i] -= l[k][i] * z[k];
        z[i] /= l[i][i];
        state[i] += z[i] * scale[i];
    }
}

void gauss_newton(int runs, int passes, int early, int late, const double *x, const double *y, const double *s,
                  double early_weight, double late_weight, double sound, const double *measured, double *state)
{
    for (int r = 0; r < runs; r++, state += 4, measured += early + late)
        for (int pass = 0; pass < passes; pass++) {
            double sums[SUMS] = {0};
            early_sums(early, x, y, s, measured, state, early_weight, sums);
            late_sums(late, x + early, y + early, s + early, measured + early, state, late_weight, sound, sums);
            step(sums, state);
        }
}
