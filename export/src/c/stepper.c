/* Terms of sine and cosine beyond the first one, which are enough for an eighth of a turn. */
#define CIRCULAR @circular@U
/* The farthest a field is told to turn: further, its place would not be known to a microstep. */
#define MOST_TURNS @turns@

static int32_t nearest(@name@_real x)
{
    return (int32_t)((x < R(0.0)) ? (x - R(0.5)) : (x + R(0.5)));
}

/* Sine and cosine of an angle in turns. */
static void turn(@name@_real turns, @name@_real *sine, @name@_real *cosine)
{
    const int32_t quarter = nearest(R(4.0) * turns);
    const @name@_real x = (turns - (R(0.25) * (@name@_real)quarter)) * R(6.283185307179586);
    const @name@_real square = x * x;
    @name@_real s_term = x;
    @name@_real c_term = R(1.0);
    @name@_real s = x;
    @name@_real c = R(1.0);
    uint32_t k;
    for (k = 1U; k <= CIRCULAR; k++) {
        const @name@_real twice = R(2.0) * (@name@_real)k;
        c_term = -(c_term * square) / (twice * (twice - R(1.0)));
        s_term = -(s_term * square) / (twice * (twice + R(1.0)));
        c += c_term;
        s += s_term;
    }
    switch ((uint32_t)quarter & 3U) {
    case 0U:
        *sine = s;
        *cosine = c;
        break;
    case 1U:
        *sine = c;
        *cosine = -s;
        break;
    case 2U:
        *sine = -s;
        *cosine = -c;
        break;
    default:
        *sine = -c;
        *cosine = s;
        break;
    }
}

/* The fields go where they are told. */
static void turn_fields(void)
{
    uint32_t i;
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        @name@_real sine;
        @name@_real cosine;
        turn((plant.told[i] * TURNS[i]) + R(0.125), &sine, &cosine);
        plant.z[FIRST_INPUT + (2U * i)] = FIELD[i] * cosine;
        plant.z[FIRST_INPUT + (2U * i) + 1U] = FIELD[i] * sine;
    }
}

static @name@_real within(@name@_real x, @name@_real most)
{
    return (x > most) ? most : ((x < -most) ? -most : x);
}

/* Currents that hold the rotors where they are. */
static void hold_rotors(const @name@_real position[])
{
    uint32_t i;
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        const uint32_t first = SINE[i] - 2U;
        plant.told[i] = position[SHAFT[i]] * WAY[i];
        turn((plant.told[i] * TURNS[i]) + R(0.125), &plant.z[SINE[i]], &plant.z[SINE[i] + 1U]);
        plant.z[first] = within(HOLDING[i] * plant.z[SINE[i] + 1U], MOST[i]);
        plant.z[first + 1U] = within(HOLDING[i] * plant.z[SINE[i]], MOST[i]);
    }
    turn_fields();
}

/* Takes up commands, unless one of them is no number or too far from the last one. */
static @name@_status take_input(const @name@_real input[])
{
    @name@_real next[@NAME@_DRIVES];
    uint32_t i;
    int is_new = 0;
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        if ((!is_number(input[i])) || (size_of(input[i] * TURNS[i]) > MOST_TURNS)) {
            return @NAME@_NO_NUMBER;
        }
        next[i] = (MICROSTEP[i] > R(0.0)) ? ((@name@_real)nearest(input[i] / MICROSTEP[i]) * MICROSTEP[i]) : input[i];
        if (size_of(next[i] - plant.told[i]) > FARTHEST[i]) {
            return @NAME@_TOO_FAR;
        }
        if ((next[i] < plant.told[i]) || (next[i] > plant.told[i])) {
            is_new = 1;
        }
    }
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        /* A turn of Newton's method brings sine and cosine back to the circle, from which rounding leads away. */
        @name@_real *sine = &plant.z[SINE[i]];
        @name@_real *cosine = &plant.z[SINE[i] + 1U];
        const @name@_real factor = R(1.5) - (R(0.5) * ((*sine * *sine) + (*cosine * *cosine)));
        *sine *= factor;
        *cosine *= factor;
        plant.told[i] = next[i];
    }
    multiply();
    if (is_new) {
        turn_fields();
        refreshed();
        plant.at_edge = 1U;
        settle();
    }
    return plant.status;
}

/* Outputs of the second phases, and how far the rotors are behind. */
static void read_steppers(@name@_output *out)
{
    uint32_t i;
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        const @name@_real lag = plant.told[i] - (out->position[SHAFT[i]] * WAY[i]);
        out->second_current[i] = value_of(row_of(OTHER_TABLE + i, plant.does));
        out->second_voltage[i] = value_of(row_of(OTHER_TABLE + @NAME@_DRIVES + i, plant.does));
        out->lost_steps[i] = 4 * nearest(lag * TURNS[i]);
    }
}
