/*
 * An instance of the machine for co-simulation: what the functions of the standard have in common.
 *
 * The machine is that of machine.c, whose numbers are fixed: parameters can be read and not be changed. All of its state
 * lies in static variables, of each thread its own where the compiler knows how; an instance keeps a copy of it and puts
 * it there for the time of a call.
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_MSC_VER)
#define LOCAL __declspec(thread)
#elif defined(__GNUC__)
#define LOCAL __thread
#else
#define LOCAL
#endif

#include "machine.c"

/* --- variables ---------------------------------------------------------------------------------------------------- */

/* Values that a variable can stand for. */
enum what {
    IS_TIME,     /* time */
    IS_INPUT,    /* an input as it was set: its number */
    IS_FIXED,    /* a number of the machine: its start */
    IS_HIDDEN,   /* a condition of a mode, which only model exchange asks for */
    IS_TAKEN,    /* an input as the machine takes it: its drive */
    IS_ROW,      /* a row of a table, times a factor, within a limit */
    IS_STATE,    /* a state: its place */
    IS_POSITION, /* of a body, times a factor */
    IS_SPEED,
    IS_FRICTION, /* on a body: its number in FRICTION */
    IS_MOTION,   /* what a body does */
    IS_CONTACT,  /* what a spring does: its number in CONTACT */
    IS_COUNTS    /* of an encoder, by a factor */
};

enum role { INPUT, PARAMETER, OUTPUT, INNER };

typedef struct {
    uint32_t reference;
    uint8_t is_whole;
    uint8_t is_continuous;
    enum role role;
    enum what what;
    uint16_t index;
    uint16_t table;
    uint8_t quantity; /* which integrated quantity starts with its value; NONE */
    double factor;
    double limit; /* zero for none */
    double start;
} variable;

@variables@

/* --- instances ---------------------------------------------------------------------------------------------------- */

enum phase { INSTANTIATED = 1, INITIALIZING = 2, IN_EVENT = 4, STEPPING = 8, TERMINATED = 16 };
#define READABLE (INITIALIZING | IN_EVENT | STEPPING | TERMINATED)
#define SETTABLE (INSTANTIATED | INITIALIZING | IN_EVENT | STEPPING)
#define ALIVE (INSTANTIATED | READABLE)

enum status { OK = 0, DISCARD = 2, ERROR = 3 };

/* All that a state is. */
typedef struct {
    unsigned char plant[sizeof plant];
    enum phase phase;
    double time; /* s */
    double stop; /* s */
    uint8_t has_stop;
    uint8_t is_made;
    uint8_t is_set; /* inputs that the machine does not know yet */
    uint8_t is_over;
    double quantity[QUANTITIES];
    double input[INPUTS];
    double slope[INPUTS];
    double since[INPUTS];
} kept;

typedef struct unit unit;
typedef void (*teller)(unit *own, int status, const char *message);

struct unit {
    kept now;
    kept **states;
    size_t state_count;
    int is_logging;
    teller tell;
    void *environment;
    void *logger;
    char *name;
    void *update; /* the callback within steps, of 3.0 */
    int has_events;
    int can_return;
};

static int says(unit *own, int status, const char *message)
{
    if ((own->tell != NULL) && (own->is_logging != 0)) {
        own->tell(own, status, message);
    }
    return status;
}

static int refuse(unit *own, const char *message) { return says(own, ERROR, message); }

static int allows(unit *own, int phases)
{
    return (((int)own->now.phase & phases) != 0) ? 1 : (refuse(own, "this function cannot be called here"), 0);
}

static void renew(unit *own)
{
    uint32_t k;
    memset(&own->now, 0, sizeof own->now);
    own->now.phase = INSTANTIATED;
    own->now.is_set = 1U;
    for (k = 0U; k < QUANTITIES; k++) {
        own->now.quantity[k] = QUANTITY_START[k];
    }
}

static int go_into(unit *own, int from, enum phase to)
{
    if (!allows(own, from)) {
        return ERROR;
    }
    own->now.phase = to;
    return OK;
}

/* The span of a run, before its initialization. */
static int set_up(unit *own, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    uint32_t k;
    if (!allows(own, INSTANTIATED)) {
        return ERROR;
    }
    if (!is_number(start) || ((has_stop != 0) && !(stop >= start)) || ((has_tolerance != 0) && !(tolerance > 0.0))) {
        return refuse(own, "a run has a finite start, an end behind it and a tolerance above zero");
    }
    own->now.time = start;
    own->now.stop = stop;
    own->now.has_stop = (has_stop != 0) ? 1U : 0U;
    for (k = 0U; k < INPUTS; k++) {
        own->now.since[k] = start;
    }
    return OK;
}

static int start_over(unit *own)
{
    if (!allows(own, ALIVE)) {
        return ERROR;
    }
    renew(own);
    return OK;
}

#define NO_EXCHANGE_HERE "these sources do no model exchange"

static char *copied(const char *text)
{
    const size_t length = (text == NULL) ? 0U : strlen(text);
    char *copy = malloc(length + 1U);
    if (copy != NULL) {
        if (length > 0U) {
            memcpy(copy, text, length);
        }
        copy[length] = '\0';
    }
    return copy;
}

static unit *make(const char *name, const char *token, int is_logging)
{
    unit *own = NULL;
    if ((token != NULL) && (strcmp(token, TOKEN) == 0)) {
        own = calloc(1U, sizeof *own);
    }
    if (own != NULL) {
        own->name = copied(name);
        own->is_logging = is_logging;
        renew(own);
    }
    return own;
}

static void destroy(unit *own)
{
    if (own != NULL) {
        size_t k;
        for (k = 0U; k < own->state_count; k++) {
            free(own->states[k]);
        }
        free(own->states);
        free(own->name);
        free(own);
    }
}

/* --- the machine -------------------------------------------------------------------------------------------------- */

static void put_in(const unit *own) { memcpy(&plant, own->now.plant, sizeof plant); }
static void take_out(unit *own) { memcpy(own->now.plant, &plant, sizeof plant); }

static double input_now(const unit *own, uint32_t k)
{
    return own->now.input[k] + (own->now.slope[k] * (own->now.time - own->now.since[k]));
}

/* Tells the machine its inputs, which are states of it that rise at a rate. */
static void take_inputs(const unit *own)
{
    uint32_t k;
    int is_new = 0;
    for (k = 0U; k < INPUTS; k++) {
        if (INPUT_DRIVE[k] != NONE) {
            const uint32_t at = FIRST_INPUT + INPUT_DRIVE[k];
            const double value = input_now(own, k);
            const double slope = own->now.slope[k];
            if ((plant.z[at] < value) || (plant.z[at] > value) || (plant.z[at + DRIVES] < slope) ||
                (plant.z[at + DRIVES] > slope)) {
                plant.z[at] = value;
                plant.z[at + DRIVES] = slope;
                plant.carry[at] = 0.0;
                plant.carry[at + DRIVES] = 0.0;
                is_new = 1;
            }
        }
    }
    if (is_new != 0) {
        refreshed();
        plant.at_edge = 1U;
        begin();
        settle();
    }
}

/* Makes the machine in its start, where that is not done yet, and puts it in. */
static void prepare(unit *own)
{
    if (own->now.is_made == 0U) {
        double position[BODIES];
        double speed[BODIES];
        uint32_t k;
        int has_current = 0;
        for (k = 0U; k < BODIES; k++) {
            const body_start *body = &BODY_START[k];
            position[k] = body->position;
            speed[k] = body->speed;
            if (body->position_of != NONE) {
                const double way = own->now.quantity[body->position_of] - body->from;
                position[k] = (body->is_leader != 0U) ? own->now.quantity[body->position_of]
                                                      : (body->position + (body->ratio * way));
            }
            if (body->speed_of != NONE) {
                speed[k] = body->ratio * own->now.quantity[body->speed_of];
            }
        }
        machine_start(position, speed);
        for (k = 0U; k < DRIVES; k++) {
            if ((CURRENT_PLACE[k] != NONE) && (CURRENT_OF[k] != NONE)) {
                plant.z[CURRENT_PLACE[k]] = own->now.quantity[CURRENT_OF[k]];
                has_current = 1;
            }
        }
        if (has_current != 0) {
            plant.at_edge = 1U;
            begin();
            settle();
        }
        own->now.is_made = 1U;
        own->now.is_set = 1U;
        take_out(own);
    } else {
        put_in(own);
    }
}

/* Puts the machine in as the inputs that are set now make it. */
static void look_at(unit *own)
{
    prepare(own);
    if (own->now.is_set != 0U) {
        take_inputs(own);
    }
}

/* Goes on to `end`, s. */
static int go(unit *own, double end)
{
    double left = end - own->now.time;
    int status = OK;
    look_at(own);
    own->now.is_set = 0U;
    plant.status = MACHINE_DONE;
    while ((left > 0.0) && (status == OK) && (own->now.is_over == 0U)) {
        const double part = (left < MACHINE_STEP) ? left : MACHINE_STEP;
        double rest = part;
        machine_status ended;
        begin();
        ended = go_on(&rest);
        left -= part - rest;
        if (ended == MACHINE_LEFT_TRAVEL) {
            own->now.is_over = 1U;
        } else if ((ended == MACHINE_NO_NUMBER) || ((ended == MACHINE_TOO_MANY_EVENTS) && !(rest < part))) {
            status = refuse(own, "the machine cannot go on");
        } else {
            /* Many events are no reason to stop, as long as time goes on. */
            plant.status = MACHINE_DONE;
        }
    }
    own->now.time = ((own->now.is_over != 0U) || (status != OK)) ? (end - left) : end;
    take_out(own);
    return status;
}

/* Whether a step from `current` of `size` can be. */
static int can_step(unit *own, double current, double size, double *end)
{
    const double near = 1e-9 * ((size > size_of(own->now.time)) ? size : size_of(own->now.time));
    if (!is_number(current) || !is_number(size) || !(size > 0.0)) {
        (void)refuse(own, "a step has a finite size above zero");
        return 0;
    }
    *end = current + size;
    if ((size_of(current - own->now.time) > near) || !(*end > own->now.time)) {
        (void)refuse(own, "a step begins where the last one ended");
        return 0;
    }
    if ((own->now.has_stop != 0U) && (*end > (own->now.stop + near))) {
        (void)refuse(own, "a step ends at the stop time at the latest");
        return 0;
    }
    return 1;
}

/* --- values ------------------------------------------------------------------------------------------------------- */

static const variable *variable_of(uint32_t reference)
{
    uint32_t low = 0U;
    uint32_t high = VARIABLE_COUNT;
    while (low < high) {
        const uint32_t middle = (low + high) / 2U;
        if (VARIABLE[middle].reference < reference) {
            low = middle + 1U;
        } else {
            high = middle;
        }
    }
    return ((low < VARIABLE_COUNT) && (VARIABLE[low].reference == reference)) ? &VARIABLE[low] : NULL;
}

/* The whole number next to a value; of two, that away from zero. */
static double nearest(double value)
{
    const double size = size_of(value);
    double whole = size;
    if (size < 4503599627370496.0) {
        whole = (double)(int64_t)size;
        whole += ((size - whole) >= 0.5) ? 1.0 : 0.0;
    }
    return (value < 0.0) ? -whole : whole;
}

/* The load on a body at rest that decides, by its table; NONE where the gear holds all. */
static uint32_t holding(const friction *law, int of_least)
{
    uint32_t found = law->load;
    uint32_t k;
    for (k = 1U; k < law->loads; k++) {
        const double own = value_of(row_of(law->load + k, plant.does));
        const double other = value_of(row_of(found, plant.does));
        found = ((of_least != 0) ? (own < other) : (own > other)) ? (law->load + k) : found;
    }
    return found;
}

static double friction_on(const friction *law, const machine_output *out)
{
    const double speed = out->speed[law->body];
    double value = 0.0;
    if (out->motion[law->body] == 0) {
        if (law->loads > 0U) {
            const double least = value_of(row_of(holding(law, 1), plant.does));
            const double most = value_of(row_of(holding(law, 0), plant.does));
            value = ((least > 0.0) ? least : 0.0) + ((most < 0.0) ? most : 0.0);
        }
    } else if (out->motion[law->body] < 0) {
        value = (law->viscous[1] * speed) - law->coulomb[1];
    } else {
        value = (law->viscous[0] * speed) + ((out->motion[law->body] == 1) ? law->coulomb[0] : 0.0);
    }
    return value;
}

/* The value of a variable of the machine that is put in. */
static double value_now(const unit *own, const variable *of, const machine_output *out)
{
    double value = 0.0;
    switch (of->what) {
    case IS_TIME:
        value = own->now.time;
        break;
    case IS_INPUT:
        value = input_now(own, of->index);
        break;
    case IS_FIXED:
        value = of->start;
        break;
    case IS_TAKEN:
        value = plant.z[FIRST_INPUT + of->index];
        break;
    case IS_ROW:
        value = value_of(row_of(of->table, plant.does));
        if (of->limit > 0.0) {
            value = (value > of->limit) ? of->limit : ((value < -of->limit) ? -of->limit : value);
        }
        value *= of->factor;
        break;
    case IS_STATE:
        value = plant.z[of->index];
        break;
    case IS_POSITION:
        value = out->position[of->index] * of->factor;
        break;
    case IS_SPEED:
        value = out->speed[of->index] * of->factor;
        break;
    case IS_FRICTION:
        value = friction_on(&FRICTION[of->index], out);
        break;
    case IS_MOTION:
        value = (double)out->motion[of->index];
        break;
    case IS_CONTACT:
        value = (CONTACT[of->index].element == NONE)
                    ? (double)CONTACT[of->index].code[0]
                    : (double)CONTACT[of->index].code[plant.does[CONTACT[of->index].element]];
        break;
    case IS_COUNTS:
        value = nearest(out->position[of->index] * of->factor);
        break;
    case IS_HIDDEN:
    default:
        break;
    }
    return value + 0.0;
}

/* Values of variables of one type, into one of two places. */
static int get(unit *own, const uint32_t references[], size_t count, double reals[], int32_t wholes[])
{
    machine_output out;
    size_t k;
    if (!allows(own, READABLE)) {
        return ERROR;
    }
    if ((count > 0U) && ((references == NULL) || ((reals == NULL) && (wholes == NULL)))) {
        return refuse(own, "a null pointer was given");
    }
    look_at(own);
    machine_read(&out);
    for (k = 0U; k < count; k++) {
        const variable *of = variable_of(references[k]);
        if ((of == NULL) || (of->is_whole != ((wholes != NULL) ? 1U : 0U))) {
            return refuse(own, "there is no such variable of this type");
        }
        if (of->what == IS_HIDDEN) {
            return refuse(own, "conditions of modes are for model exchange, which these sources do not have");
        }
        if (wholes != NULL) {
            wholes[k] = (int32_t)value_now(own, of, &out);
        } else {
            reals[k] = value_now(own, of, &out);
        }
    }
    return OK;
}

/* Whether a value can be given to a variable now; says why not. */
static int can_set(unit *own, const variable *of, double value)
{
    const char *why = NULL;
    const int is_before = ((int)own->now.phase & (INSTANTIATED | INITIALIZING)) != 0;
    if ((of == NULL) || (of->is_whole != 0U)) {
        why = "there is no such variable of this type";
    } else if (!is_number(value)) {
        why = "a value is a finite number";
    } else if (of->role == INPUT) {
        why = ((INPUT_DRIVE[of->index] == NONE) && ((value < 0.0) || (value > 0.0)))
                  ? "the machine of these sources takes no force from outside"
                  : NULL;
    } else if (of->role == PARAMETER) {
        why = ((value < of->start) || (value > of->start)) ? "the numbers of the machine are fixed in these sources" : NULL;
    } else if ((of->quantity == NONE) || !is_before) {
        why = "inputs can be set, and before the start what the machine starts from";
    } else {
        /* it can */
    }
    return (why == NULL) ? 1 : (refuse(own, why), 0);
}

/* Sets all values, or none. */
static int set(unit *own, const uint32_t references[], const double values[], size_t count)
{
    size_t k;
    if (!allows(own, SETTABLE)) {
        return ERROR;
    }
    if ((count > 0U) && ((references == NULL) || (values == NULL))) {
        return refuse(own, "a null pointer was given");
    }
    for (k = 0U; k < count; k++) {
        if (!can_set(own, variable_of(references[k]), values[k])) {
            return ERROR;
        }
    }
    for (k = 0U; k < count; k++) {
        const variable *of = variable_of(references[k]);
        if (of->role == INPUT) {
            own->now.input[of->index] = values[k];
            own->now.slope[of->index] = 0.0;
            own->now.since[of->index] = own->now.time;
            own->now.is_set = 1U;
        } else if (of->quantity != NONE) {
            own->now.quantity[of->quantity] = values[k];
            own->now.is_made = 0U;
        } else {
            /* it has this value */
        }
    }
    return OK;
}

/* --- derivatives -------------------------------------------------------------------------------------------------- */

static double weighed(const double row[], const double z[])
{
    double sum = 0.0;
    uint32_t j;
    for (j = 0U; j < SIZE; j++) {
        sum += row[j] * z[j];
    }
    return sum;
}

/* The next derivative of z: a constant has none. */
static void differentiate(double z[])
{
    double next[STATES];
    uint32_t i;
    for (i = 0U; i < STATES; i++) {
        next[i] = weighed(plant.rate[i], z);
    }
    for (i = 0U; i < SIZE; i++) {
        z[i] = (i < STATES) ? next[i] : 0.0;
    }
}

/* The change of a variable along a change of z in the present mode; that of ways by those of speeds. */
static double change_of(const unit *own, const variable *of, const double z[], const double before[])
{
    const friction *law;
    machine_output out;
    double value = 0.0;
    switch (of->what) {
    case IS_TAKEN:
        value = z[FIRST_INPUT + of->index];
        break;
    case IS_INPUT:
        value = (INPUT_DRIVE[of->index] == NONE) ? 0.0 : z[FIRST_INPUT + INPUT_DRIVE[of->index]];
        break;
    case IS_ROW:
        value = weighed(row_of(of->table, plant.does), z) * of->factor;
        break;
    case IS_STATE:
        value = z[of->index];
        break;
    case IS_POSITION:
        value = before[SPEED[of->index]] * of->factor;
        break;
    case IS_SPEED:
        value = z[SPEED[of->index]] * of->factor;
        break;
    case IS_FRICTION:
        law = &FRICTION[of->index];
        machine_read(&out);
        if (out.motion[law->body] != 0) {
            value = law->viscous[(out.motion[law->body] < 0) ? 1 : 0] * z[SPEED[law->body]];
        } else if (law->loads > 0U) {
            const double *least = row_of(holding(law, 1), plant.does);
            const double *most = row_of(holding(law, 0), plant.does);
            value = ((value_of(least) > 0.0) ? weighed(least, z) : 0.0) +
                    ((value_of(most) < 0.0) ? weighed(most, z) : 0.0);
        } else {
            /* it leaves that to another body */
        }
        break;
    case IS_TIME:
    case IS_FIXED:
    case IS_HIDDEN:
    case IS_MOTION:
    case IS_CONTACT:
    case IS_COUNTS:
    default:
        break;
    }
    (void)own;
    return value + 0.0;
}

#define ORDERS 7

static int output_derivatives(unit *own, const uint32_t references[], const int orders[], double into[], size_t count)
{
    size_t k;
    if (!allows(own, STEPPING | TERMINATED)) {
        return ERROR;
    }
    if ((count > 0U) && ((references == NULL) || (orders == NULL) || (into == NULL))) {
        return refuse(own, "a null pointer was given");
    }
    look_at(own);
    for (k = 0U; k < count; k++) {
        const variable *of = variable_of(references[k]);
        double z[SIZE];
        double before[SIZE];
        int order;
        if ((of == NULL) || (of->role != OUTPUT) || (of->is_continuous == 0U) || (orders[k] < 1) ||
            (orders[k] > ORDERS)) {
            return refuse(own, "there are derivatives of orders 1 to 7 of outputs that are continuous");
        }
        memcpy(z, plant.z, sizeof z);
        memcpy(before, z, sizeof before);
        for (order = 0; order < orders[k]; order++) {
            memcpy(before, z, sizeof before);
            differentiate(z);
        }
        into[k] = change_of(own, of, z, before);
    }
    return OK;
}

/* The change of variables where inputs change, in the present mode. */
static int directional(unit *own, const uint32_t unknowns[], size_t count, const uint32_t knowns[], size_t changed,
                       const double seed[], double into[])
{
    static const double still[SIZE] = {0.0};
    double z[SIZE];
    size_t k;
    if (!allows(own, READABLE)) {
        return ERROR;
    }
    if (((count > 0U) && ((unknowns == NULL) || (into == NULL))) ||
        ((changed > 0U) && ((knowns == NULL) || (seed == NULL)))) {
        return refuse(own, "a null pointer was given");
    }
    memset(z, 0, sizeof z);
    for (k = 0U; k < changed; k++) {
        const variable *of = variable_of(knowns[k]);
        if ((of == NULL) || (of->role != INPUT) || (INPUT_DRIVE[of->index] == NONE) || !is_number(seed[k])) {
            return refuse(own, "there are derivatives with respect to inputs");
        }
        z[FIRST_INPUT + INPUT_DRIVE[of->index]] += seed[k];
    }
    look_at(own);
    for (k = 0U; k < count; k++) {
        const variable *of = variable_of(unknowns[k]);
        if ((of == NULL) || (of->is_whole != 0U)) {
            return refuse(own, "there is no such variable of this type");
        }
        into[k] = change_of(own, of, z, still);
    }
    return OK;
}

/* --- states ------------------------------------------------------------------------------------------------------- */

static size_t place_of(const unit *own, const void *state)
{
    size_t k = 0U;
    while ((k < own->state_count) && (own->states[k] != state)) {
        k++;
    }
    return k;
}

static int hand_out(unit *own, const kept *state, void **into)
{
    const size_t place = (*into == NULL) ? own->state_count : place_of(own, *into);
    kept *copy;
    if (place < own->state_count) {
        *own->states[place] = *state;
        return OK;
    }
    copy = malloc(sizeof *copy);
    if (copy != NULL) {
        kept **list = realloc(own->states, (own->state_count + 1U) * sizeof *list);
        if (list != NULL) {
            *copy = *state;
            own->states = list;
            own->states[own->state_count] = copy;
            own->state_count++;
            *into = copy;
            return OK;
        }
        own->states = (own->state_count == 0U) ? NULL : own->states;
        free(copy);
    }
    return refuse(own, "there is no memory left");
}

static int keep(unit *own, void **state)
{
    if (!allows(own, ALIVE)) {
        return ERROR;
    }
    return (state == NULL) ? refuse(own, "a null pointer was given") : hand_out(own, &own->now, state);
}

static int bring_back(unit *own, const void *state)
{
    const size_t place = place_of(own, state);
    if (!allows(own, ALIVE)) {
        return ERROR;
    }
    if (place == own->state_count) {
        return refuse(own, "this is no state of this instance");
    }
    own->now = *own->states[place];
    return OK;
}

static int let_go(unit *own, void **state)
{
    if ((state != NULL) && (*state != NULL)) {
        const size_t place = place_of(own, *state);
        if (place == own->state_count) {
            return refuse(own, "this is no state of this instance");
        }
        free(own->states[place]);
        own->state_count--;
        own->states[place] = own->states[own->state_count];
        *state = NULL;
    }
    return OK;
}

/* A state as bytes: a mark, a sum over what follows, the state. */
#define BYTES (8U + 8U + sizeof(kept))

static int bytes_of(unit *own, const void *state, size_t *size)
{
    if (place_of(own, state) == own->state_count) {
        return refuse(own, "this is no state of this instance");
    }
    *size = BYTES;
    return OK;
}

static uint64_t sum_of(const unsigned char bytes[], size_t count)
{
    /* Fowler, Noll and Vo's hash. */
    uint64_t sum = UINT64_C(14695981039346656037);
    size_t k;
    for (k = 0U; k < count; k++) {
        sum = (sum ^ bytes[k]) * UINT64_C(1099511628211);
    }
    return sum;
}

static uint64_t mark(void) { return sum_of((const unsigned char *)TOKEN, strlen(TOKEN)) ^ sizeof(kept); }

static int write_out(unit *own, const void *state, unsigned char bytes[], size_t size)
{
    const size_t place = place_of(own, state);
    const uint64_t head = mark();
    uint64_t sum;
    if (place == own->state_count) {
        return refuse(own, "this is no state of this instance");
    }
    if ((bytes == NULL) || (size < BYTES)) {
        return refuse(own, "there is too little room for the bytes of a state");
    }
    memcpy(&bytes[16], own->states[place], sizeof(kept));
    sum = sum_of(&bytes[16], sizeof(kept));
    memcpy(bytes, &head, 8U);
    memcpy(&bytes[8], &sum, 8U);
    return OK;
}

static int read_in(unit *own, const unsigned char bytes[], size_t size, void **state)
{
    kept other;
    uint64_t head;
    uint64_t sum;
    uint32_t k;
    if ((bytes == NULL) || (state == NULL) || (size != BYTES)) {
        return refuse(own, "these bytes are no state of this machine");
    }
    memcpy(&head, bytes, 8U);
    memcpy(&sum, &bytes[8], 8U);
    if ((head != mark()) || (sum != sum_of(&bytes[16], sizeof(kept)))) {
        return refuse(own, "these bytes are no state of this machine");
    }
    memcpy(&other, &bytes[16], sizeof other);
    if (other.is_made != 0U) {
        /* Addresses are those of another process: the rows are taken up again. */
        memcpy(&plant, other.plant, sizeof plant);
        for (k = 0U; k < ELEMENTS; k++) {
            if (plant.does[k] >= ELEMENT_STATES[k]) {
                return refuse(own, "these bytes are no state of this machine");
            }
        }
        take_up_mode();
        memcpy(other.plant, &plant, sizeof plant);
    }
    return hand_out(own, &other, state);
}
