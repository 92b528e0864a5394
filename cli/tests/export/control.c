/* Steps a controller along the observations in in.bin and writes its commands into out.bin. */
#include "clock.h"
#include "model.h"
#include <stdio.h>

int main(void)
{
    FILE *in = fopen("in.bin", "rb");
    FILE *out = fopen("out.bin", "wb");
    double seen[12];
    unsigned long steps = 0;
    if ((in == NULL) || (out == NULL)) {
        return 2;
    }
    clock_start();
    model_control_reset();
    while (fread(seen, sizeof(double), 12, in) == 12) {
        model_real s[12];
        model_reference now, ahead;
        double command;
        model_real given;
        int k;
        for (k = 0; k < 12; k++) {
            s[k] = (model_real)seen[k];
        }
        now.position = s[0];
        now.speed = s[1];
        now.acceleration = s[2];
        now.jerk = s[3];
        now.snap = s[4];
        ahead.position = s[5];
        ahead.speed = s[6];
        ahead.acceleration = s[7];
        ahead.jerk = s[8];
        ahead.snap = s[9];
        clock_begin();
        given = model_control(&now, &ahead, s[10], s[11]);
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
