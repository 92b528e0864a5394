/* Steps a plant along the commands in in.bin and writes the ways of its bodies after each step into out.bin; of steppers
   (STEPPERS) both currents of each drive, too, and prints the lost steps. */
#include "clock.h"
#include "model.h"
#include <stdio.h>

int main(void)
{
    FILE *in = fopen("in.bin", "rb");
    FILE *out = fopen("out.bin", "wb");
    double command[MODEL_DRIVES];
    model_real input[MODEL_DRIVES];
    model_output now;
    unsigned long steps = 0;
    int status = 0;
    unsigned k;
    if ((in == NULL) || (out == NULL)) {
        return 2;
    }
    clock_start();
    model_reset();
    while ((status == 0) && (fread(command, sizeof(double), MODEL_DRIVES, in) == MODEL_DRIVES)) {
        for (k = 0; k < MODEL_DRIVES; k++) {
            input[k] = (model_real)command[k];
        }
        clock_begin();
        status = (int)model_step(input);
        clock_end();
        model_read(&now);
        for (k = 0; k < MODEL_BODIES; k++) {
            double way = (double)now.position[k];
            fwrite(&way, sizeof way, 1, out);
        }
#ifdef STEPPERS
        for (k = 0; k < MODEL_DRIVES; k++) {
            double currents[2] = {(double)now.current[k], (double)now.second_current[k]};
            fwrite(currents, sizeof currents, 1, out);
        }
#endif
        steps++;
    }
    printf("steps %lu status %d events %lu instructions %lu at most %lu\n", steps, status,
           (unsigned long)model_events(), clock_sum / (steps ? steps : 1), clock_most);
#ifdef STEPPERS
    for (k = 0; k < MODEL_DRIVES; k++) {
        printf("lost %ld\n", (long)now.lost_steps[k]);
    }
#endif
    fclose(in);
    fclose(out);
    return status;
}
