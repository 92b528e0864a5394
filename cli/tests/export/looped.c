/* Plant and controllers of steppers in a loop. in.bin has, for each step, the reference of each drive along its belt, m,
   and of each slide position and derivatives; PER steps are a sample, and a command acts LATE steps after its sample.
   An encoder has COUNTS per radian, none if zero. out.bin gets the ways of all bodies after each step. */
#include "model.h"
#include <math.h>
#include <stdio.h>
#if MODEL_DRIVES == 2
#include "model_left.h"
#include "model_right.h"
#define SLIDES 2
#else
#define SLIDES 1
#endif
#define ROW (MODEL_DRIVES + 5 * SLIDES)

static double measured(double angle)
{
    return RADIUS * ((COUNTS > 0.0) ? round(angle * COUNTS) / COUNTS : angle);
}

int main(void)
{
    static double waiting[MODEL_DRIVES][1 << 20];
    double row[ROW], acting[MODEL_DRIVES] = {0.0};
    FILE *in = fopen("in.bin", "rb");
    FILE *out = fopen("out.bin", "wb");
    model_output now;
    long k;
    unsigned d, b;
    if ((in == NULL) || (out == NULL)) {
        return 2;
    }
    model_reset();
#if MODEL_DRIVES == 2
    model_left_control_reset();
    model_right_control_reset();
#else
    model_control_reset();
#endif
    for (k = 0; fread(row, sizeof(double), ROW, in) == ROW; k++) {
        double input[MODEL_DRIVES];
        model_status status;
        if (k % PER == 0) {
            model_read(&now);
#if MODEL_DRIVES == 2
            {
                model_left_reference left[SLIDES];
                model_right_reference right[SLIDES];
                for (b = 0; b < SLIDES; b++) {
                    const double *y = row + MODEL_DRIVES + 5 * b;
                    left[b].position = right[b].position = y[0];
                    left[b].speed = right[b].speed = y[1];
                    left[b].acceleration = right[b].acceleration = y[2];
                    left[b].jerk = right[b].jerk = y[3];
                    left[b].snap = right[b].snap = y[4];
                }
                waiting[0][k + LATE] = model_left_control(left, left, measured(now.position[0]), now.current[0]);
                waiting[1][k + LATE] = model_right_control(right, right, measured(now.position[1]), now.current[1]);
            }
#else
            {
                const double *y = row + MODEL_DRIVES;
                model_reference reference = {y[0], y[1], y[2], y[3], y[4]};
                waiting[0][k + LATE] = model_control(&reference, &reference, measured(now.position[0]), now.current[0]);
            }
#endif
        }
        if ((k >= LATE) && ((k - LATE) % PER == 0)) {
            for (d = 0; d < MODEL_DRIVES; d++) {
                acting[d] = waiting[d][k];
            }
        }
        /* The correction is added to the reference. */
        for (d = 0; d < MODEL_DRIVES; d++) {
            input[d] = row[d] + acting[d];
        }
        status = model_step(input);
        if (status != MODEL_DONE) {
            printf("status %d at step %ld\n", (int)status, k);
            return 1;
        }
        model_read(&now);
        for (b = 0; b < MODEL_BODIES; b++) {
            fwrite(&now.position[b], sizeof(double), 1, out);
        }
    }
    fclose(in);
    fclose(out);
    return 0;
}
