/* Takes up inputs, unless one of them is no number. */
static @name@_status take_input(const @name@_real input[])
{
    uint32_t i;
    int is_new = 0;
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        if (!is_number(input[i])) {
            return @NAME@_NO_NUMBER;
        }
        if ((input[i] < plant.z[FIRST_INPUT + i]) || (input[i] > plant.z[FIRST_INPUT + i])) {
            is_new = 1;
        }
    }
    if (is_new) {
        for (i = 0U; i < @NAME@_DRIVES; i++) {
            plant.z[FIRST_INPUT + i] = input[i];
        }
        refreshed();
        plant.at_edge = 1U;
        settle();
    }
    return plant.status;
}
