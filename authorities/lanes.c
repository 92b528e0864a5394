/* Many machines at once, each in a lane of a vector: what somebody writes who needs this one axis, three figures and nothing else.
 *
 * Runge-Kutta of fourth order with a fixed step. Friction in the plainest way that sticks: a body at zero speed whose load is within its Coulomb
 * friction stays there, and a step that turns a speed round ends at zero. All ways are along the belt (r phi, x, r phi), so that no product with the
 * radius is left. A batch ends when all of its machines rest for good.
 *
 * lanes rows STEPS              positions phi1, x, phi3 of the nominal machine at 5 V, 1001 rows of doubles on standard output
 * lanes ends STEPS              of machines whose 16 numbers are on standard input, where the carts are after 5 V and after 10 V, m
 * lanes rate STEPS SECONDS SEED batches of machines, each number by +-20 %, 5 V and 10 V for 0.25 s, for so long; simulations and seconds as text
 *
 * gcc -O3 -march=native -ffast-math -DLANES=8 (four doubles in a vector of AVX2: -DLANES=4) */

#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef double V __attribute__((vector_size(8 * LANES)));
typedef int64_t M __attribute__((vector_size(8 * LANES)));

/* K_t, K_e, R, r; J1, m, J3; k1, k2, k3; B1, b, B3; tau1, F, tau3: Table 4, the rest of Table 2 */
enum { NUMBERS = 16 };
static const double nominal[NUMBERS] = {23e-3, 23e-3, 0.71, 0.0194, 6.3e-5, 0.362, 6.3e-5, 1.3276e5, 1.3276e5, 5.8885e4,
                                        0.0016, 19.0424, 0.0016, 0.0150, 0.2000, 0.0150};

/* One machine in each lane: force per volt, stiffness; 1/mass, damping and Coulomb force of the three. */
typedef struct { V volt, k[3], light[3], damping[3], coulomb[3]; } Machine;

static V all(double x) { return x - (V){0}; }
static V where(M mask, V a, V b) { return (V)(((M)a & mask) | ((M)b & ~mask)); }
static V size(V x) { return (V)((M)x & INT64_MAX); }
static V larger(V a, V b) { return where(a > b, a, b); }

static int any(M mask) {
    int64_t sum = 0;
    for (int lane = 0; lane < LANES; lane++) sum |= mask[lane];
    return sum != 0;
}

static void set(Machine *machine, int lane, const double p[NUMBERS]) {
    double r = p[3], arm[3] = {r, 1.0, r};
    machine->volt[lane] = p[0] / p[2] / r;
    for (int body = 0; body < 3; body++) {
        machine->k[body][lane] = p[7 + body];
        machine->light[body][lane] = arm[body] * arm[body] / p[4 + body];
        machine->damping[body][lane] = p[10 + body] / (arm[body] * arm[body]);
        machine->coulomb[body][lane] = p[13 + body] / arm[body];
    }
    machine->damping[0][lane] += p[0] * p[1] / p[2] / (r * r);
}

/* Forces of the belt and the motor. */
static inline void load(const Machine *m, const V q[3], V force, V out[3]) {
    V f1 = m->k[0] * (q[0] - q[1]), f2 = m->k[1] * (q[1] - q[2]), f3 = m->k[2] * (q[2] - q[0]);
    out[0] = f3 - f1 + force, out[1] = f1 - f2, out[2] = f2 - f3;
}

/* Accelerations; a body whose mask is empty rests. */
static inline void rate(const Machine *m, const V q[3], const V v[3], V force, const V dry[3], const M moves[3], V out[3]) {
    V loads[3];
    load(m, q, force, loads);
    for (int b = 0; b < 3; b++) out[b] = (V)((M)((loads[b] - m->damping[b] * v[b] - dry[b]) * m->light[b]) & moves[b]);
}

/* One second by steps of 1/steps ms; figures of each lane; rows of the first lane where they are wanted. */
static void simulate(const Machine *m, double volts, int steps, V figures[3], double *rows, double r) {
    V q[3] = {{0}}, v[3] = {{0}}, peak_speed = {0}, peak_force = {0};
    V h = all(1e-3 / steps), half = 0.5 * h, sixth = h / 6.0;
    int row = 0;
    for (; row < 1000; row++) {
        V force = m->volt * (row < 250 ? volts : 0.0);
        M moving = {0};
        for (int step = 0; step < steps; step++) {
            V loads[3], dry[3], side[3], a[4][3], w[3][3], z[3];
            M moves[3];
            load(m, q, force, loads);
            for (int b = 0; b < 3; b++) {
                M slides = v[b] != 0.0, breaks = size(loads[b]) > m->coulomb[b];
                side[b] = where(slides, v[b], loads[b]);
                moves[b] = slides | breaks;
                dry[b] = where(side[b] > 0.0, m->coulomb[b], -m->coulomb[b]);
                moving |= moves[b];
            }
            rate(m, q, v, force, dry, moves, a[0]);
            for (int b = 0; b < 3; b++) w[0][b] = v[b] + half * a[0][b], z[b] = q[b] + half * v[b];
            rate(m, z, w[0], force, dry, moves, a[1]);
            for (int b = 0; b < 3; b++) w[1][b] = v[b] + half * a[1][b], z[b] = q[b] + half * w[0][b];
            rate(m, z, w[1], force, dry, moves, a[2]);
            for (int b = 0; b < 3; b++) w[2][b] = v[b] + h * a[2][b], z[b] = q[b] + h * w[1][b];
            rate(m, z, w[2], force, dry, moves, a[3]);
            for (int b = 0; b < 3; b++) {
                q[b] += sixth * (v[b] + 2.0 * (w[0][b] + w[1][b]) + w[2][b]);
                v[b] += sixth * (a[0][b] + 2.0 * (a[1][b] + a[2][b]) + a[3][b]);
                v[b] = where(v[b] * side[b] < 0.0, all(0.0), v[b]);
            }
        }
        peak_speed = larger(peak_speed, size(v[1]));
        peak_force = larger(peak_force, size(m->k[0] * (q[0] - q[1])));
        if (rows) rows[3 * row + 3] = q[0][0] / r, rows[3 * row + 4] = q[1][0], rows[3 * row + 5] = q[2][0] / r;
        if (row >= 250 && !any(moving)) break;
    }
    for (row++; rows && row < 1000; row++) memcpy(rows + 3 * row + 3, rows + 3 * row, 3 * sizeof *rows);
    figures[0] = q[1], figures[1] = peak_speed, figures[2] = peak_force;
}

/* 0.8 to 1.2, by splitmix64 */
static double factor(uint64_t *state) {
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return 0.8 + 0.4 * ((z ^ z >> 31) >> 11) * 0x1p-53;
}

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec + 1e-9 * time.tv_nsec;
}

int main(int count, char **words) {
    if (count < 3 || atoi(words[2]) < 1) return 2;
    int steps = atoi(words[2]);
    Machine machine;
    V figures[3];
    if (!strcmp(words[1], "rows")) {
        static double rows[3003];
        for (int lane = 0; lane < LANES; lane++) set(&machine, lane, nominal);
        simulate(&machine, 5.0, steps, figures, rows, nominal[3]);
        return fwrite(rows, sizeof rows, 1, stdout) != 1;
    }
    if (!strcmp(words[1], "ends")) {
        double p[NUMBERS];
        for (;;) {
            for (int i = 0; i < NUMBERS; i++)
                if (scanf("%lf", &p[i]) != 1) return i != 0;
            for (int lane = 0; lane < LANES; lane++) set(&machine, lane, p);
            for (int pulse = 1; pulse <= 2; pulse++) {
                simulate(&machine, 5.0 * pulse, steps, figures, 0, 0.0);
                printf("%.17g\n", figures[0][0]);
            }
        }
    }
    if (count < 5) return 2;
    uint64_t state = strtoull(words[4], 0, 10);
    double seconds = atof(words[3]), begin = now(), sum = 0.0;
    long done = 0;
    while (now() - begin < seconds) {
        for (int lane = 0; lane < LANES; lane++) {
            double p[NUMBERS];
            for (int i = 0; i < NUMBERS; i++) p[i] = nominal[i] * factor(&state);
            set(&machine, lane, p);
        }
        for (int pulse = 1; pulse <= 2; pulse++, done += LANES) {
            simulate(&machine, 5.0 * pulse, steps, figures, 0, 0.0);
            for (int lane = 0; lane < LANES; lane++) sum += figures[0][lane] + figures[1][lane] + figures[2][lane];
        }
    }
    printf("%ld %.6f %.17g\n", done, now() - begin, sum);
    return 0;
}
