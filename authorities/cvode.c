/* SUNDIALS CVODE with root finding on the paper's machine: Table 4 friction, the rest of Table 2, a pulse of 5 V for 0.25 s,
 * 1 s, 1000 output samples. Usage: cvode PROBLEM bdf|adams|adams-fixed RTOL RUNS (adams-fixed: fixed-point iteration instead of
 * Newton's with the Jacobian). Problems:
 *
 *   coulomb              the machine as it is
 *   stribeck             F_s = 0.3 F_c on top of each Coulomb friction, v_s = 0.05 m/s at the belt
 *   lugre-1e4, lugre-1e7 bristles under the cart: sigma0 in N/m, sigma1 = 60 N s/m, F_s = 0.3 F_c, v_s = 0.01 m/s
 *   follows              the lengths of spans 1 and 2 follow the cart, E A = 8.335e9 Pa 5.5626e-6 m^2
 *
 * Prints the best run's seconds, the number of events, and the 1001 samples of phi1, x, phi3.
 *
 * For a fit: cvode fit METHOD RTOL. Each line of the standard input is a run: the pulse's volts, three viscous and three Coulomb
 * frictions. The answer is 1001 doubles of phi1, then 1001 of x, in binary; NaN where the run failed.
 *
 *   J phi1'' = -r f1 + r f3 - tau_f1 + K_t i     f1 = k1 (r phi1 - x)      i = (u - K_e w1) / R
 *   M x''    =  f1 - f2 - F_f                    f2 = k2 (x - r phi3)
 *   J phi3'' =  r f2 - r f3 - tau_f2             f3 = k3 (r phi3 - r phi1)
 *   F_f = b v + sign(v) (F_c + F_s exp(-(v/v_s)^2))
 *   F_f = b v + sigma0 z + sigma1 z'             z' = v - sigma0 |v| z / (F_c + F_s exp(-(v/v_s)^2))
 *
 * Integrated mode by mode: each inertia slides forward (+1), backward (-1) or is stuck (0); on bristles it never sticks.
 * Restarted at mode changes and edges.
 */
#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sundials/sundials_types.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <time.h>

#define SAMPLES 1000
#define MOST_STATES 7 /* with the bristles' deflection */
#define ROOTS 6
#define BLIND 1e-6
#define MOST_EVENTS 200

static const double r = 0.0194, k1 = 1.3276e5, k2 = 1.3276e5, k3 = 5.8885e4, M = 0.362, J = 6.3e-5;
static const double Kt = 23e-3, Ke = 23e-3, R = 0.71;
static const double EA = 8.335e9 * 5.5626e-6, l1 = 0.34925, l3 = 0.7874, sigma1 = 60.0, bristle_vs = 0.01;
static double viscous[3] = {0.0016, 19.0424, 0.0016}, coulomb[3] = {0.015, 0.2, 0.015}, pulse = 5.0;
static const double above[3] = {0.3 * 0.015, 0.3 * 0.2, 0.3 * 0.015}, vs[3] = {0.05 / 0.0194, 0.05, 0.05 / 0.0194};

typedef struct {
    int mode[3], left; /* left: the inertia that has just left zero, not asked for BLIND seconds whether it is there */
    double u, since;
    int curve, follows, states;
    double sigma0; /* zero: no bristles */
    double breakaway[3];
} Machine;

/* Stiffness of spans 1 and 2 with the cart at x, and of span 3: k = E A / l. */
static inline void stiffness(const Machine *m, double x, double k[3]) {
    k[0] = m->follows ? EA / (l1 - x) : k1;
    k[1] = m->follows ? EA / (l1 + x) : k2;
    k[2] = m->follows ? EA / l3 : k3;
}

/* Bristles: z', and its derivatives by v and z. */
static inline double bristles(const Machine *m, double v, double z, double *by_v, double *by_z) {
    double fs = 0.3 * coulomb[1], left = fs * exp(-(v / bristle_vs) * (v / bristle_vs)), g = coulomb[1] + left;
    double slope = -2.0 * v / (bristle_vs * bristle_vs) * left, sign = v >= 0 ? 1.0 : -1.0, s = sign * v;
    *by_z = -m->sigma0 * s / g;
    *by_v = 1.0 - m->sigma0 * z * (sign / g - s * slope / (g * g));
    return v - m->sigma0 * s * z / g;
}

/* F_s exp(-(v/v_s)^2) of a body that slides. */
static inline double curve(int b, double v) { return above[b] * exp(-(v / vs[b]) * (v / vs[b])); }

/* Loads on the three inertias: every force but friction. */
static inline void loads(const Machine *m, const double *y, double load[3]) {
    double k[3];
    stiffness(m, y[2], k);
    double f1 = k[0] * (r * y[0] - y[2]), f2 = k[1] * (y[2] - r * y[4]), f3 = k[2] * r * (y[4] - y[0]);
    load[0] = r * (f3 - f1) + Kt / R * (m->u - Ke * y[1]);
    load[1] = f1 - f2;
    load[2] = r * (f2 - f3);
}

static int rhs(realtype t, N_Vector yv, N_Vector dv, void *data) {
    (void)t;
    const Machine *m = data;
    const double *y = NV_DATA_S(yv), inertia[3] = {J, M, J};
    double *d = NV_DATA_S(dv), load[3];
    loads(m, y, load);
    for (int b = 0; b < 3; b++) {
        d[2 * b] = y[2 * b + 1];
        d[2 * b + 1] = m->mode[b] ? (load[b] - viscous[b] * y[2 * b + 1] - m->mode[b] * coulomb[b]) / inertia[b] : 0.0;
        if (m->curve && m->mode[b]) d[2 * b + 1] -= m->mode[b] * curve(b, y[2 * b + 1]) / inertia[b];
    }
    if (m->sigma0) {
        double by_v, by_z;
        d[6] = bristles(m, y[3], y[6], &by_v, &by_z);
        d[3] = (load[1] - viscous[1] * y[3] - m->sigma0 * y[6] - sigma1 * d[6]) / M;
    }
    return 0;
}

static int jacobian(realtype t, N_Vector yv, N_Vector f, SUNMatrix a, void *data, N_Vector t1, N_Vector t2, N_Vector t3) {
    (void)t, (void)f, (void)t1, (void)t2, (void)t3;
    const Machine *m = data;
    const double *y = NV_DATA_S(yv), inertia[3] = {J, M, J};
    double k[3], d1 = 0.0, d2 = 0.0; /* how f1 and f2 change with x beside -k1 and k2 */
    stiffness(m, y[2], k);
    if (m->follows) d1 = k[0] * k[0] / EA * (r * y[0] - y[2]), d2 = -k[1] * k[1] / EA * (y[2] - r * y[4]);
    SUNMatZero(a);
    SM_ELEMENT_D(a, 0, 1) = SM_ELEMENT_D(a, 2, 3) = SM_ELEMENT_D(a, 4, 5) = 1.0;
    if (m->mode[0]) {
        SM_ELEMENT_D(a, 1, 0) = -r * r * (k[0] + k[2]) / J;
        SM_ELEMENT_D(a, 1, 1) = -(viscous[0] + Kt * Ke / R) / J;
        SM_ELEMENT_D(a, 1, 2) = r * (k[0] - d1) / J;
        SM_ELEMENT_D(a, 1, 4) = r * r * k[2] / J;
    }
    if (m->mode[1]) {
        SM_ELEMENT_D(a, 3, 0) = r * k[0] / M;
        SM_ELEMENT_D(a, 3, 2) = (-(k[0] + k[1]) + d1 - d2) / M;
        SM_ELEMENT_D(a, 3, 3) = -viscous[1] / M;
        SM_ELEMENT_D(a, 3, 4) = r * k[1] / M;
    }
    if (m->mode[2]) {
        SM_ELEMENT_D(a, 5, 0) = r * r * k[2] / J;
        SM_ELEMENT_D(a, 5, 2) = r * (k[1] + d2) / J;
        SM_ELEMENT_D(a, 5, 4) = -r * r * (k[1] + k[2]) / J;
        SM_ELEMENT_D(a, 5, 5) = -viscous[2] / J;
    }
    if (m->sigma0) {
        double by_v, by_z;
        bristles(m, y[3], y[6], &by_v, &by_z);
        SM_ELEMENT_D(a, 6, 3) = by_v, SM_ELEMENT_D(a, 6, 6) = by_z;
        SM_ELEMENT_D(a, 3, 3) -= sigma1 * by_v / M;
        SM_ELEMENT_D(a, 3, 6) = -(m->sigma0 + sigma1 * by_z) / M;
    }
    for (int b = 0; m->curve && b < 3; b++) {
        double v = y[2 * b + 1];
        if (m->mode[b]) SM_ELEMENT_D(a, 2 * b + 1, 2 * b + 1) += m->mode[b] * curve(b, v) * 2 * v / (vs[b] * vs[b]) / inertia[b];
    }
    return 0;
}

/* Two per inertia, positive inside the mode: speed in its direction, or what is left to breakaway on either side. */
static int roots(realtype t, N_Vector yv, realtype *g, void *data) {
    const Machine *m = data;
    const double *y = NV_DATA_S(yv);
    double load[3];
    loads(m, y, load);
    for (int b = 0; b < 3; b++) {
        g[2 * b] = m->mode[b] ? m->mode[b] * y[2 * b + 1] : m->breakaway[b] - load[b];
        g[2 * b + 1] = m->mode[b] ? 1.0 : m->breakaway[b] + load[b];
        if ((b == m->left && t < m->since + BLIND) || (b == 1 && m->sigma0)) g[2 * b] = g[2 * b + 1] = 1.0;
    }
    return 0;
}

/* Mode of an inertia at zero speed under a load. */
static int at_rest(const Machine *m, int b, double load) {
    return load > m->breakaway[b] ? 1 : load < -m->breakaway[b] ? -1 : 0;
}

static void check(int status, const char *what) {
    if (status < 0) {
        fprintf(stderr, "%s failed with %d\n", what, status);
        exit(1);
    }
}

/* One run from rest; samples y[k] at k ms. Returns the number of events. */
static int simulate(void *cvode, N_Vector y, Machine *m, double (*samples)[MOST_STATES]) {
    static const double edges[] = {0.25, 1.0};
    const double volts[] = {pulse, 0.0};
    double *state = NV_DATA_S(y), t = 0.0, load[3];
    int events = 0, sample = 1;
    memset(state, 0, m->states * sizeof(double));
    memset(m->mode, 0, sizeof m->mode);
    m->mode[1] = m->sigma0 != 0.0;
    memcpy(samples[0], state, m->states * sizeof(double));
    for (int piece = 0; piece < 2; piece++) {
        m->u = volts[piece];
        m->left = -1, m->since = t;
        loads(m, state, load);
        for (int b = 0; b < 3; b++)
            if (!m->mode[b] && (m->mode[b] = at_rest(m, b, load[b]))) events++, m->left = b;
        check(CVodeReInit(cvode, t, y), "CVodeReInit");
        check(CVodeSetStopTime(cvode, edges[piece]), "CVodeSetStopTime");
        while (t < edges[piece]) {
            double next = sample / 1000.0;
            if (next > edges[piece]) next = edges[piece];
            int status = CVode(cvode, next, y, &t, CV_NORMAL);
            check(status, "CVode");
            if (status == CV_ROOT_RETURN) {
                int found[ROOTS];
                check(CVodeGetRootInfo(cvode, found), "CVodeGetRootInfo");
                loads(m, state, load);
                m->left = -1, m->since = t;
                for (int b = 0; b < 3; b++) {
                    if (m->mode[b]) {
                        if (found[2 * b]) {
                            state[2 * b + 1] = 0.0;
                            loads(m, state, load);
                            m->mode[b] = at_rest(m, b, load[b]);
                            m->left = m->mode[b] ? b : -1;
                            events++;
                        }
                    } else if (found[2 * b] || found[2 * b + 1]) {
                        m->mode[b] = found[2 * b] ? 1 : -1;
                        m->left = b;
                        events++;
                    }
                }
                if (events > MOST_EVENTS) return events;
                check(CVodeReInit(cvode, t, y), "CVodeReInit");
                check(CVodeSetStopTime(cvode, edges[piece]), "CVodeSetStopTime");
            }
            if (t >= next && sample <= SAMPLES && t >= sample / 1000.0) memcpy(samples[sample++], state, m->states * sizeof(double));
        }
    }
    return events;
}

/* Runs as the standard input asks for them. */
static int serve(void *cvode, N_Vector y, Machine *m, double (*samples)[MOST_STATES]) {
    static double out[2][SAMPLES + 1];
    while (scanf("%lf %lf %lf %lf %lf %lf %lf", &pulse, viscous, viscous + 1, viscous + 2, coulomb, coulomb + 1, coulomb + 2) == 7) {
        memcpy(m->breakaway, coulomb, sizeof coulomb);
        int failed = simulate(cvode, y, m, samples) > MOST_EVENTS;
        for (int k = 0; k <= SAMPLES; k++) out[0][k] = failed ? NAN : samples[k][0], out[1][k] = failed ? NAN : samples[k][2];
        fwrite(out, sizeof out, 1, stdout);
        fflush(stdout);
    }
    return 0;
}

int main(int argc, char **argv) {
    int fit = argc == 4 && !strcmp(argv[1], "fit");
    if (argc != 5 && !fit) return fprintf(stderr, "usage: cvode coulomb|stribeck|lugre-1e4|lugre-1e7|follows bdf|adams|adams-fixed RTOL RUNS\n"), 2;
    int adams = !strncmp(argv[2], "adams", 5), fixed = !strcmp(argv[2], "adams-fixed"), runs = fit ? 0 : atoi(argv[4]), events = 0;
    double rtol = atof(argv[3]);
    static double samples[SAMPLES + 1][MOST_STATES];
    Machine m = {{0, 0, 0}, -1, 0.0, 0.0, !strcmp(argv[1], "stribeck"), !strcmp(argv[1], "follows"), 6, 0.0, {0.0, 0.0, 0.0}};
    if (!strncmp(argv[1], "lugre-", 6)) m.sigma0 = atof(argv[1] + 6), m.states = 7;
    for (int b = 0; b < 3; b++) m.breakaway[b] = coulomb[b] + (m.curve ? above[b] : 0.0);

    SUNContext context;
    check(SUNContext_Create(NULL, &context), "SUNContext_Create");
    N_Vector y = N_VNew_Serial(m.states, context), atol = N_VNew_Serial(m.states, context);
    /* Absolute tolerances in proportion to the run's own sizes: 2.5 rad, 10 rad/s, 0.05 m, 0.2 m/s; bristles F_c/sigma0. */
    const double size[MOST_STATES] = {2.5, 10.0, 0.05, 0.2, 2.5, 10.0, m.sigma0 ? coulomb[1] / m.sigma0 : 0.0};
    for (int k = 0; k < m.states; k++) NV_Ith_S(y, k) = 0.0, NV_Ith_S(atol, k) = rtol * size[k];

    void *cvode = CVodeCreate(adams ? CV_ADAMS : CV_BDF, context);
    check(CVodeInit(cvode, rhs, 0.0, y), "CVodeInit");
    check(CVodeSVtolerances(cvode, rtol, atol), "CVodeSVtolerances");
    check(CVodeSetUserData(cvode, &m), "CVodeSetUserData");
    if (fixed) {
        check(CVodeSetNonlinearSolver(cvode, SUNNonlinSol_FixedPoint(y, 0, context)), "CVodeSetNonlinearSolver");
    } else {
        SUNMatrix matrix = SUNDenseMatrix(m.states, m.states, context);
        check(CVodeSetLinearSolver(cvode, SUNLinSol_Dense(y, matrix, context), matrix), "CVodeSetLinearSolver");
        check(CVodeSetJacFn(cvode, jacobian), "CVodeSetJacFn");
    }
    int falling[ROOTS] = {-1, -1, -1, -1, -1, -1};
    check(CVodeRootInit(cvode, ROOTS, roots), "CVodeRootInit");
    check(CVodeSetRootDirection(cvode, falling), "CVodeSetRootDirection");
    check(CVodeSetNoInactiveRootWarn(cvode), "CVodeSetNoInactiveRootWarn");
    check(CVodeSetMaxNumSteps(cvode, 1000000), "CVodeSetMaxNumSteps");

    if (fit) return serve(cvode, y, &m, samples);

    /* The best of the runs: what the method costs, not what else the computer did. */
    double best = INFINITY;
    for (int run = 0; run < runs; run++) {
        struct timespec from, to;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
        events = simulate(cvode, y, &m, samples);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
        best = fmin(best, (to.tv_sec - from.tv_sec) + 1e-9 * (to.tv_nsec - from.tv_nsec));
    }
    if (events > MOST_EVENTS) return fprintf(stderr, "chatter: the tolerance is too loose\n"), 1;
    printf("%.9e %d\n", best, events);
    for (int k = 0; k <= SAMPLES; k++)
        printf("%.17g %.17g %.17g\n", samples[k][0], samples[k][2], samples[k][4]);
    return 0;
}
