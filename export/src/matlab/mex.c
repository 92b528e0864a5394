/*
 * @title@
 *
 * [position, current] = @name@_mex(commands): the plant of @name@_plant.c from rest, a step for each row of commands; the
 * rows of position are the ways of the bodies after each step, rad or m. To build it, in Octave:
 *
 *     mkoctfile --mex @name@_mex.c @name@_plant.c
 *
 * and in MATLAB: mex @name@_mex.c @name@_plant.c. Written by taut @version@.
 */
#include "mex.h"
#include "@name@_plant.h"

void mexFunction(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[])
{
    @name@_plant_output now;
    @name@_plant_real input[@NAME@_PLANT_DRIVES];
    const double *commands;
    double *position;
    double *current;
    mwSize steps;
    mwSize k;
    mwSize i;
    if ((nrhs != 1) || (!mxIsDouble(prhs[0])) || (mxGetN(prhs[0]) != @NAME@_PLANT_DRIVES)) {
        mexErrMsgTxt("a matrix of commands is needed: a row for each step, a column for each drive");
    }
    commands = mxGetPr(prhs[0]);
    steps = mxGetM(prhs[0]);
    plhs[0] = mxCreateDoubleMatrix(steps, @NAME@_PLANT_BODIES, mxREAL);
    position = mxGetPr(plhs[0]);
    current = NULL;
    if (nlhs > 1) {
        plhs[1] = mxCreateDoubleMatrix(steps, @NAME@_PLANT_DRIVES, mxREAL);
        current = mxGetPr(plhs[1]);
    }
    @name@_plant_reset();
    for (k = 0; k < steps; k++) {
        for (i = 0; i < @NAME@_PLANT_DRIVES; i++) {
            input[i] = commands[k + (i * steps)];
        }
        if (@name@_plant_step(input) != @NAME@_PLANT_DONE) {
            mexErrMsgTxt("more events than a step may have, something left its travel, or a command jumps too far");
        }
        @name@_plant_read(&now);
        for (i = 0; i < @NAME@_PLANT_BODIES; i++) {
            position[k + (i * steps)] = now.position[i];
        }
        for (i = 0; (i < @NAME@_PLANT_DRIVES) && (current != NULL); i++) {
            current[k + (i * steps)] = now.current[i];
        }
    }
}
