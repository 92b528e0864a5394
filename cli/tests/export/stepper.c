/* Steps a machine with steppers along the commands in in.bin and writes the positions of its bodies and both currents of
   each drive after each step into out.bin; prints the lost steps. */
#include "model.h"
#include <stdio.h>

int main(void)
{
    FILE *in = fopen("in.bin", "rb");
    FILE *out = fopen("out.bin", "wb");
    double command[MODEL_DRIVES];
    model_real input[MODEL_DRIVES];
    model_output now;
    int status = 0;
    unsigned k;
    if ((in == NULL) || (out == NULL)) {
        return 2;
    }
    model_reset();
    model_read(&now);
    while ((status == 0) && (fread(command, sizeof(double), MODEL_DRIVES, in) == MODEL_DRIVES)) {
        for (k = 0; k < MODEL_DRIVES; k++) {
            input[k] = (model_real)command[k];
        }
        status = (int)model_step(input);
        model_read(&now);
        for (k = 0; k < MODEL_BODIES; k++) {
            double position = (double)now.position[k];
            fwrite(&position, sizeof position, 1, out);
        }
        for (k = 0; k < MODEL_DRIVES; k++) {
            double currents[2] = {(double)now.current[k], (double)now.second_current[k]};
            fwrite(currents, sizeof currents, 1, out);
        }
    }
    for (k = 0; k < MODEL_DRIVES; k++) {
        printf("%d ", (int)now.lost_steps[k]);
    }
    fclose(in);
    fclose(out);
    return status;
}
