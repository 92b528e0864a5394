/* Steps a controller along the observations in in.bin and writes its commands into out.bin. */
#include "clock.h"
#include "model.h"
#include <stdio.h>

/* Slides with a reference each. */
#ifndef SLIDES
#define SLIDES 1
#endif
#define SEEN (10 * SLIDES + 2)

int main(void)
{
    FILE *in = fopen("in.bin", "rb");
    FILE *out = fopen("out.bin", "wb");
    double seen[SEEN];
    unsigned long steps = 0;
    if ((in == NULL) || (out == NULL)) {
        return 2;
    }
    clock_start();
    model_control_reset();
    while (fread(seen, sizeof(double), SEEN, in) == SEEN) {
        model_real s[SEEN];
        model_reference references[2 * SLIDES];
        double command;
        model_real given;
        int k;
        for (k = 0; k < SEEN; k++) {
            s[k] = (model_real)seen[k];
        }
        for (k = 0; k < 2 * SLIDES; k++) {
            references[k].position = s[5 * k];
            references[k].speed = s[5 * k + 1];
            references[k].acceleration = s[5 * k + 2];
            references[k].jerk = s[5 * k + 3];
            references[k].snap = s[5 * k + 4];
        }
        clock_begin();
        given = model_control(references, references + SLIDES, s[SEEN - 2], s[SEEN - 1]);
        clock_end();
        command = (double)given;
        fwrite(&command, sizeof command, 1, out);
        steps++;
    }
    printf("steps %lu instructions %lu at most %lu\n", steps, clock_sum / (steps ? steps : 1), clock_most);
    fclose(in);
    fclose(out);
    return 0;
}
