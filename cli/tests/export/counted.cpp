// Steps a plant of counted numbers along the commands in in.bin, and tells the most that a step computed, its bounds, the
// events, and how many steps had too many of them.
#include "model.h"
#include <stdio.h>

unsigned long counted::products, counted::sums;

int main()
{
    FILE *in = fopen("in.bin", "rb");
    double command[MODEL_DRIVES];
    unsigned long products = 0, sums = 0, given_up = 0;
    unsigned k;
    model_reset();
    while (fread(command, sizeof(double), MODEL_DRIVES, in) == MODEL_DRIVES) {
        model_real input[MODEL_DRIVES];
        const uint32_t before = model_events();
        for (k = 0; k < MODEL_DRIVES; k++) {
            input[k] = command[k];
        }
        counted::products = counted::sums = 0;
        given_up += (model_step(input) == MODEL_TOO_MANY_EVENTS);
        products = counted::products > products ? counted::products : products;
        sums = counted::sums > sums ? counted::sums : sums;
        if (model_events() - before > MODEL_EVENTS) {
            return 1;
        }
    }
    printf("%lu %lu %lu %lu %u %lu\n", products, MODEL_PRODUCTS, sums, MODEL_SUMS, (unsigned)model_events(), given_up);
    return 0;
}
