/* Steps a plant along the commands in in.bin and writes the ways of its bodies after each step into out.bin. */
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
        steps++;
    }
    printf("steps %lu status %d events %lu instructions %lu at most %lu\n", steps, status,
           (unsigned long)model_events(), clock_sum / (steps ? steps : 1), clock_most);
    fclose(in);
    fclose(out);
    return status;
}
