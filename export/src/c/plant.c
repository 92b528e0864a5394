/* --- the plant ------------------------------------------------------------------------------------------------------ */
/*
 * z = (states, products, inputs, 1). In a mode, what all elements do together, every state's rate is a row of weights
 * on z, and the mode holds while no guard, a row too, is below zero. A product is that of two places of z before it. A
 * step is a chain of Taylor series of z; the first fall of a guard along a series is an event, located to the last bit,
 * after which the rows of the next mode hold.
 */

@tables@

/* Places that move along a series, and the first of the inputs. */
#define MOVING (STATES + PRODUCTS)
#define FIRST_INPUT MOVING

#define NONE 255U
#define LEAVE 255U
/* Codes of a body's motion: backward is 0. */
#define STUCK 1U
#define FORWARD 2U
/* Ranks of guards. */
#define RANK_GEARS 2U
#define RANK_BODIES 3U

/* Changes at one instant after which a body that stops rests. */
#define TURNS_AT_ONCE 8U
/* Halvings of a series, and of all series of a step, within which a guard's first fall is told. */
#define HALVINGS 20U
#define HALVINGS_OF_STEP @halvings@U
/* Turns of Newton's method for a root, and all turns: after Newton's, bisections to the last bit. */
#define NEWTON @newton@U
#define ROOT (NEWTON + BITS)

static @local@struct {
    @name@_real z[SIZE];
    @name@_real carry[STATES]; /* what additions to z have lost */
    @name@_real tolerance[ROOM_SLOTS];
    @name@_real since_change;
    const @name@_real *rate[STATES];
    const @name@_real *row[ROOM_GUARDS];
    uint32_t events;
    uint32_t begin;    /* events before this step */
    uint32_t halvings; /* that this step may still have */
    uint32_t changes;
    uint32_t active_count;
    uint8_t active[ROOM_GUARDS];
    uint8_t does[ROOM_ELEMENTS];
    uint8_t fresh[ROOM_SLOTS];
    uint8_t is_fresh;
    uint8_t at_edge;
    @name@_status status;
@told@} plant;

/* The Taylor series under way, and the coefficients of a guard along it. */
static @local@@name@_real term[ORDER + 1][SIZE];
static @local@@name@_real coefficient[ORDER + 1];
static @local@@name@_real bernstein[ORDER + 1];
static @local@@name@_real guard_value[ROOM_GUARDS];
/* Sizes of the terms of the series, by which rounding is told, and whether they are those of the series under way. */
static @local@@name@_real term_size[ORDER + 1][SIZE];
static @local@int has_sizes;
/* First term of each guard that counts, and whether the guard may fall. */
static @local@uint8_t first_order[ROOM_GUARDS];
static @local@uint8_t may_fall[ROOM_GUARDS];

static @name@_real size_of(@name@_real x) { return (x < R(0.0)) ? -x : x; }

static int is_number(@name@_real x)
{
    const @name@_real zero = x - x;
    return (zero <= R(0.0)) && (zero >= R(0.0));
}

/* The row of a table in a mode. */
static const @name@_real *row_of(uint32_t table, const uint8_t does[])
{
    uint32_t index = 0U;
    uint32_t k;
    for (k = DEPENDS_FIRST[table]; k < DEPENDS_FIRST[table + 1U]; k++) {
        index = (index * ELEMENT_STATES[DEPENDS[k]]) + does[DEPENDS[k]];
    }
    return WEIGHT[ENTRY[ENTRY_FIRST[table] + index]];
}

/* The value of a row. */
static @name@_real value_of(const @name@_real row[])
{
    @name@_real sum = R(0.0);
    uint32_t j;
    for (j = 0U; j < SIZE; j++) {
        sum += row[j] * plant.z[j];
    }
    return sum;
}

/* The rounding error of its value. */
static @name@_real noise_of(const @name@_real row[])
{
    @name@_real sum = R(0.0);
    uint32_t j;
    for (j = 0U; j < SIZE; j++) {
        sum += size_of(row[j] * plant.z[j]);
    }
    return ROUNDING * sum;
}

/* Takes the rows of the mode. */
static void take_up_mode(void)
{
    uint32_t k;
    plant.active_count = 0U;
    for (k = 0U; k < STATES; k++) {
        plant.rate[k] = row_of(k, plant.does);
    }
    for (k = 0U; k < GUARDS; k++) {
        if ((GUARD[k].element == NONE) || (plant.does[GUARD[k].element] == GUARD[k].state)) {
            plant.active[plant.active_count] = (uint8_t)k;
            plant.row[plant.active_count] = row_of(GUARD[k].table, plant.does);
            plant.active_count++;
        }
    }
}

/* A row of a guard where bodies rest: gears that lose power carry as they do at rest. */
static const @name@_real *resting_row(uint32_t guard)
{
    static @local@uint8_t does[ROOM_ELEMENTS];
    uint32_t k;
    for (k = 0U; k < ELEMENTS; k++) {
        does[k] = plant.does[k];
    }
    for (k = 0U; k < RESTINGS; k++) {
        does[RESTING[k].element] = (uint8_t)((value_of(row_of(RESTING[k].table, plant.does)) >= R(0.0)) ? 0U : 1U);
    }
    return row_of(GUARD[guard].table, does);
}

/* Whether a guard is that of a body's breakaway. */
static int is_breakaway(uint32_t guard)
{
    return (GUARD[guard].forward != NONE) && (GUARD[guard].decides == 0U);
}

static uint32_t fresh_order(uint32_t guard)
{
    return is_breakaway(guard) ? 0U : (uint32_t)plant.fresh[GUARD[guard].fresh];
}

static void start_fresh(uint32_t note, uint32_t order)
{
    plant.fresh[note] = (uint8_t)order;
    plant.is_fresh = 1U;
}

static void refreshed(void)
{
    uint32_t k;
    if (plant.is_fresh != 0U) {
        for (k = 0U; k < SLOTS; k++) {
            plant.fresh[k] = 0U;
        }
        plant.is_fresh = 0U;
    }
}

/* --- Taylor series and their roots --- */

/* The k-th terms of the products, by the terms of their factors up to there. */
static void multiply_terms(@name@_real terms[][SIZE], uint32_t k)
{
    uint32_t i;
    uint32_t j;
    for (i = 0U; i < PRODUCTS; i++) {
        @name@_real sum = R(0.0);
        for (j = 0U; j <= k; j++) {
            sum += terms[j][PRODUCT[i].one] * terms[k - j][PRODUCT[i].other];
        }
        terms[k][STATES + i] = sum;
    }
}

/* z over a distance: term[k] is that of s^k for s from 0 to 1. */
static void expand(@name@_real distance)
{
    uint32_t i;
    uint32_t j;
    uint32_t k;
    has_sizes = 0;
    for (j = 0U; j < SIZE; j++) {
        term[0][j] = plant.z[j];
    }
    for (k = 1U; k <= ORDER; k++) {
        const @name@_real factor = distance * RECIPROCAL[k];
        const uint32_t places = (k == 1U) ? SIZE : MOVING;
        for (i = 0U; i < STATES; i++) {
            const @name@_real *row = plant.rate[i];
            @name@_real sum = R(0.0);
            for (j = 0U; j < places; j++) {
                sum += row[j] * term[k - 1U][j];
            }
            term[k][i] = sum * factor;
        }
        multiply_terms(term, k);
        for (i = FIRST_INPUT; i < SIZE; i++) {
            term[k][i] = R(0.0);
        }
    }
}

/* The products of z. */
static void multiply(void)
{
    uint32_t i;
    for (i = 0U; i < PRODUCTS; i++) {
        plant.z[STATES + i] = plant.z[PRODUCT[i].one] * plant.z[PRODUCT[i].other];
    }
}

/* Moves z to the place s of the series. */
static void add_series(@name@_real s)
{
    uint32_t i;
    uint32_t k;
    for (i = 0U; i < STATES; i++) {
        @name@_real moved = R(0.0);
        @name@_real sum;
        for (k = ORDER; k > 0U; k--) {
            moved = (moved + term[k][i]) * s;
        }
        /* The rounding of the addition is kept for the next one. */
        moved -= plant.carry[i];
        sum = plant.z[i] + moved;
        plant.carry[i] = (sum - plant.z[i]) - moved;
        plant.z[i] = sum;
    }
    multiply();
}

/* The coefficients of a guard along the first part of the series. */
static void along(const @name@_real row[], @name@_real part)
{
    @name@_real power = R(1.0);
    uint32_t j;
    uint32_t k;
    for (k = 0U; k <= ORDER; k++) {
        const uint32_t places = (k == 0U) ? SIZE : MOVING;
        @name@_real sum = R(0.0);
        for (j = 0U; j < places; j++) {
            sum += row[j] * term[k][j];
        }
        coefficient[k] = sum * power;
        power *= part;
    }
}

/* The sizes of the terms of the series over a distance. */
static void expand_sizes(@name@_real distance)
{
    uint32_t i;
    uint32_t j;
    uint32_t k;
    for (j = 0U; j < SIZE; j++) {
        term_size[0][j] = size_of(plant.z[j]);
    }
    for (k = 1U; k <= ORDER; k++) {
        const @name@_real factor = distance * RECIPROCAL[k];
        for (i = 0U; i < STATES; i++) {
            @name@_real sum = R(0.0);
            for (j = 0U; j < SIZE; j++) {
                sum += size_of(plant.rate[i][j]) * term_size[k - 1U][j];
            }
            term_size[k][i] = sum * factor;
        }
        multiply_terms(term_size, k);
        for (i = FIRST_INPUT; i < SIZE; i++) {
            term_size[k][i] = R(0.0);
        }
    }
    has_sizes = 1;
}

/* The first coefficient of the whole series over a distance, from `first` on, that is more than rounding; those before
   it count as zero. */
static uint32_t first_term(const @name@_real row[], @name@_real distance, uint32_t first)
{
    uint32_t found = ORDER + 1U;
    uint32_t j;
    uint32_t k;
    if (has_sizes == 0) {
        expand_sizes(distance);
    }
    for (k = first; (k <= ORDER) && (found > ORDER); k++) {
        @name@_real noise = R(0.0);
        for (j = 0U; j < SIZE; j++) {
            noise += size_of(row[j]) * term_size[k][j];
        }
        if (size_of(coefficient[k]) > (R(2.0) * ROUNDING * noise)) {
            found = k;
        }
    }
    return found;
}

/* Newton's method kept within [0, 1], at whose end the polynomial is below zero. */
static @name@_real polish(const @name@_real c[], uint32_t count, @name@_real end)
{
    @name@_real low = R(0.0);
    @name@_real high = R(1.0);
    @name@_real s = c[0] / (c[0] - end);
    uint32_t turn = 0U;
    uint32_t k;
    if (!((s > low) && (s < high))) {
        s = R(0.5);
    }
    while (turn < ROOT) {
        @name@_real p = R(0.0);
        @name@_real slope = R(0.0);
        @name@_real newton;
        for (k = count; k > 0U; k--) {
            slope = (slope * s) + p;
            p = (p * s) + c[k - 1U];
        }
        if (p < R(0.0)) {
            high = s;
        } else {
            low = s;
        }
        newton = s - (p / slope);
        turn++;
        if (size_of(newton - s) <= (EPSILON * s)) {
            s = newton;
            turn = ROOT;
        } else {
            s = ((turn < NEWTON) && (newton > low) && (newton < high)) ? newton : (R(0.5) * (low + high));
        }
    }
    return (s < R(0.0)) ? R(0.0) : ((s > R(1.0)) ? R(1.0) : s);
}

#define STAYS 0U
#define FALLS 1U
#define UNDECIDED 2U

/* Whether a polynomial, not negative at 0, falls below zero within (0, 1], and its value at 1 if it does. */
static uint32_t first_fall(const @name@_real c[], uint32_t count, int is_last, @name@_real *end_value)
{
    @name@_real least;
    @name@_real end;
    @name@_real before;
    uint32_t changes = 0U;
    uint32_t result = STAYS;
    uint32_t i;
    uint32_t k;
    int negative = 0;
    if (count == 0U) {
        return STAYS;
    }
    *end_value = c[0];
    if (c[0] < R(0.0)) {
        return FALLS;
    }
    least = c[0];
    end = c[0];
    for (k = 1U; k < count; k++) {
        const int changed = (negative != 0) ? (c[k] > R(0.0)) : (c[k] < R(0.0));
        least += (c[k] < R(0.0)) ? c[k] : R(0.0);
        end += c[k];
        if (changed) {
            changes++;
            negative = (negative == 0) ? 1 : 0;
        }
    }
    if (least >= R(0.0)) {
        return STAYS;
    }
    if ((c[0] > R(0.0)) && (changes == 1U)) {
        /* One change of sign: one root above zero (Descartes). */
        if (end < R(0.0)) {
            *end_value = end;
            result = FALLS;
        }
        return result;
    }
    /* Bernstein coefficients b_i = sum of C(i,k)/C(n,k) c_k: the polynomial lies within their hull. */
    before = R(1.0);
    for (k = 0U; k < count; k++) {
        /* 1/C(n,k), n = count - 1 */
        bernstein[k] = c[k] * before;
        before = before * (@name@_real)(k + 1U) * RECIPROCAL[(count - 1U > k) ? (count - 1U - k) : 1U];
    }
    for (k = 1U; k < count; k++) {
        for (i = count - 1U; i >= k; i--) {
            bernstein[i] += bernstein[i - 1U];
        }
    }
    changes = 0U;
    before = R(0.0);
    for (i = 0U; i < count; i++) {
        if ((before * bernstein[i]) < R(0.0)) {
            changes++;
        }
        if (bernstein[i] > R(0.0)) {
            before = R(1.0);
        } else if (bernstein[i] < R(0.0)) {
            before = R(-1.0);
        } else {
            /* as it was */
        }
    }
    if ((changes > 1U) && (!is_last)) {
        result = UNDECIDED;
    } else if (bernstein[count - 1U] < R(0.0)) {
        *end_value = bernstein[count - 1U];
        result = FALLS;
    } else {
        result = STAYS;
    }
    return result;
}

/* --- modes --- */

/* Guards, forgiven what rounding alone may have made negative. */
static void look(void)
{
    uint32_t k;
    for (k = 0U; k < plant.active_count; k++) {
        @name@_real value = value_of(plant.row[k]);
        if ((value < R(0.0)) && (size_of(value) <= (R(2.0) * noise_of(plant.row[k])))) {
            value = R(0.0);
        }
        guard_value[k] = value + plant.tolerance[GUARD[plant.active[k]].slot];
    }
}

/* Whether a guard, the k-th active one, falls along the first part of the series, and its value at the end of it. */
static uint32_t fall_along(uint32_t k, @name@_real part, int is_last, @name@_real *end)
{
    const uint32_t order = first_order[k];
    along(plant.row[k], part);
    coefficient[0] = guard_value[k];
    return first_fall(&coefficient[order], (ORDER + 1U) - order, is_last, end);
}

/* Advances by a distance, or to the first guard that falls: its place among the active ones, or NONE. */
static uint32_t advance(@name@_real distance, @name@_real *used)
{
    @name@_real part = R(1.0);
    @name@_real earliest = R(1.0);
    @name@_real end = R(0.0);
    uint32_t fallen = NONE;
    uint32_t halvings = (plant.halvings < HALVINGS) ? plant.halvings : HALVINGS;
    uint32_t k;
    look();
    expand(distance);
    /* Which guards may fall, along a part of the series that tells of all of them. */
    for (k = 0U; k < plant.active_count; k++) {
        uint32_t order = fresh_order(plant.active[k]);
        uint32_t told;
        if ((order > 0U) || ((guard_value[k] <= R(0.0)) && (guard_value[k] >= R(0.0)))) {
            along(plant.row[k], R(1.0));
            coefficient[0] = guard_value[k];
            order = first_term(plant.row[k], distance, (order > 1U) ? order : 1U);
        }
        first_order[k] = (uint8_t)order;
        told = fall_along(k, part, halvings == 0U, &end);
        while (told == UNDECIDED) {
            part *= R(0.5);
            halvings--;
            plant.halvings--;
            told = fall_along(k, part, halvings == 0U, &end);
        }
        may_fall[k] = (uint8_t)told;
    }
    /* Where each of them falls along that part. */
    for (k = 0U; k < plant.active_count; k++) {
        if ((may_fall[k] == FALLS) && (fall_along(k, part, 1, &end) == FALLS)) {
            const uint32_t order = first_order[k];
            const @name@_real s = (coefficient[order] < R(0.0))
                                      ? R(0.0)
                                      : polish(&coefficient[order], (ORDER + 1U) - order, end);
            if ((fallen == NONE) || (s < earliest) ||
                ((s <= earliest) && (GUARD[plant.active[k]].rank < GUARD[plant.active[fallen]].rank))) {
                earliest = s;
                fallen = k;
            }
        }
    }
    *used = part * earliest * distance;
    add_series(part * earliest);
    plant.since_change += *used;
    if (*used > SOON) {
        refreshed();
    }
    return fallen;
}

/* A condition on an element that has just become one is zero where it is that but for rounding. */
static void hold_part(uint32_t element)
{
    uint32_t k;
    for (k = 0U; k < plant.active_count; k++) {
        const uint32_t guard = plant.active[k];
        if (GUARD[guard].element == element) {
            const @name@_real now = value_of(plant.row[k]);
            const @name@_real noise = noise_of(plant.row[k]);
            @name@_real forgiven = R(0.0);
            uint32_t order = 0U;
            if (size_of(now) > (R(20.0) * noise)) {
                if ((GUARD[guard].rank == RANK_GEARS) && (plant.changes > TURNS_AT_ONCE)) {
                    forgiven = R(2.0) * size_of(now);
                }
            } else if (plant.changes <= TURNS_AT_ONCE) {
                forgiven = (now < R(0.0)) ? -now : R(0.0);
                order = 1U;
            } else {
                forgiven = R(40.0) * noise;
            }
            plant.tolerance[GUARD[guard].fresh] = forgiven;
            start_fresh(GUARD[guard].fresh, order);
        }
    }
}

/* What a body at zero speed does under its load, which may let it do as its guard says. */
static uint32_t decide(uint32_t guard)
{
    const @name@_real *forward = resting_row(GUARD[guard].forward);
    const @name@_real *backward = resting_row(GUARD[guard].backward);
    uint32_t to = GUARD[guard].then;
    if (value_of(forward) < -noise_of(forward)) {
        to = GUARD[GUARD[guard].forward].then;
    } else if (value_of(backward) < -noise_of(backward)) {
        to = GUARD[GUARD[guard].backward].then;
    } else {
        /* it stays */
    }
    return to;
}

/* The load on a body that goes from one motion to another may pass its breakaways by rounding. */
static void widen_breakaways(uint32_t guard, uint32_t from, uint32_t to)
{
    const uint32_t forward = GUARD[guard].forward;
    const uint32_t backward = GUARD[guard].backward;
    /* Where it stops, the load is the one on the side it came from. */
    const uint32_t side = (((to == STUCK) ? from : to) != 0U) ? forward : backward;
    const @name@_real *row = resting_row(side);
    const @name@_real noise = noise_of(row);
    const @name@_real excess = GUARD[side].drop - value_of(row);
    uint32_t order = 1U;
    if (to == STUCK) {
        order = 0U;
    } else if ((GUARD[guard].decides == 0U) && (size_of(excess) <= (R(2.0) * noise))) {
        /* Where breakaway equals Coulomb friction the acceleration starts from zero, but for rounding. */
        order = 2U;
    } else {
        /* it is accelerated */
    }
    start_fresh(GUARD[forward].fresh, order);
    plant.tolerance[GUARD[forward].slot] = ((plant.changes > TURNS_AT_ONCE) ? R(20.0) : R(2.0)) * noise;
    plant.tolerance[GUARD[backward].slot] = plant.tolerance[GUARD[forward].slot];
}

/* Goes into the mode that follows where a guard, the k-th active one, falls. */
static void change(uint32_t k)
{
    const uint32_t guard = plant.active[k];
    const uint32_t element = GUARD[guard].element;
    const int begun = size_of(value_of(plant.row[k])) <= (R(20.0) * noise_of(plant.row[k]));
    uint32_t to = GUARD[guard].then;
    uint32_t i;
    plant.changes = (plant.since_change <= MOMENT) ? (plant.changes + 1U) : 0U;
    plant.since_change = R(0.0);
    if ((plant.events - plant.begin) >= @NAME@_EVENTS) {
        plant.status = @NAME@_TOO_MANY_EVENTS;
        return;
    }
    plant.events++;
    if (to == LEAVE) {
        plant.status = @NAME@_LEFT_TRAVEL;
        return;
    }
    for (i = GUARD[guard].resets_first; i < GUARD[guard].resets_end; i++) {
        plant.z[RESET[i].place] = RESET[i].value;
        plant.carry[RESET[i].place] = R(0.0);
    }
    multiply();
    if ((GUARD[guard].decides != 0U) && (plant.changes <= TURNS_AT_ONCE)) {
        to = decide(guard);
    }
    if (GUARD[guard].forward != NONE) {
        widen_breakaways(guard, plant.does[element], to);
    }
    plant.does[element] = (uint8_t)to;
    take_up_mode();
    if (GUARD[guard].forward == NONE) {
        hold_part(element);
        if ((GUARD[guard].gently != NONE) && begun) {
            /* Let go by the motion and not by an edge of the input, a current leaves its limit with no rate. */
            start_fresh(GUARD[guard].gently, 2U);
        }
    }
}

/* Whether a guard that is zero falls: the first term of its series that is more than rounding decides. */
static int falls_from_zero(uint32_t k)
{
    uint32_t first;
    along(plant.row[k], R(1.0));
    first = first_term(plant.row[k], REACH, 1U);
    return (first <= ORDER) && (coefficient[first] < R(0.0));
}

/* The guard that does not hold here; of several, that which is settled first. */
static uint32_t fallen_guard(void)
{
    uint32_t fallen = NONE;
    uint32_t k;
    int is_expanded = 0;
    look();
    for (k = 0U; k < plant.active_count; k++) {
        const @name@_real value = guard_value[k];
        const uint32_t guard = plant.active[k];
        int falls = value < R(0.0);
        if ((value <= R(0.0)) && (value >= R(0.0)) && (fresh_order(guard) == 0U)) {
            if (is_expanded == 0) {
                expand(REACH);
                is_expanded = 1;
            }
            falls = falls_from_zero(k);
        }
        if (falls && ((fallen == NONE) || (GUARD[guard].rank < GUARD[plant.active[fallen]].rank))) {
            fallen = k;
        }
    }
    return fallen;
}

/* Changes modes, without time passing, until every guard holds. */
static void settle(void)
{
    uint32_t turn;
    uint32_t k;
    int settled = 0;
    /* A turn changes a mode, or is the one at the edge, or the last. */
    for (turn = 0U; (turn < (@NAME@_EVENTS + 3U)) && (!settled) && (plant.status == @NAME@_DONE); turn++) {
        const uint32_t fallen = fallen_guard();
        const int is_last = (fallen == NONE) || (GUARD[plant.active[fallen]].rank == RANK_BODIES);
        if ((plant.at_edge != 0U) && is_last) {
            /* The loads on bodies are known now: one that passes a breakaway by rounding alone does not break it. */
            plant.at_edge = 0U;
            for (k = 0U; k < plant.active_count; k++) {
                const uint32_t guard = plant.active[k];
                if (is_breakaway(guard)) {
                    const @name@_real noise = R(2.0) * noise_of(plant.row[k]);
                    if (noise > plant.tolerance[GUARD[guard].slot]) {
                        plant.tolerance[GUARD[guard].slot] = noise;
                    }
                }
            }
            settled = (fallen == NONE) ? 1 : 0;
        } else if (fallen != NONE) {
            change(fallen);
        } else {
            settled = 1;
        }
    }
    if (settled) {
        for (k = 0U; k < plant.active_count; k++) {
            const uint32_t guard = plant.active[k];
            if ((GUARD[guard].rank == RANK_GEARS) &&
                (size_of(value_of(plant.row[k])) <= (R(2.0) * noise_of(plant.row[k])))) {
                start_fresh(GUARD[guard].fresh, 1U);
            }
        }
    } else if (plant.status == @NAME@_DONE) {
        plant.status = @NAME@_TOO_MANY_EVENTS;
    } else {
        /* told already */
    }
}

@commands@
/* A step begins: what it may do. */
static void begin(void)
{
    plant.begin = plant.events;
    plant.halvings = HALVINGS_OF_STEP;
}

void @name@_start(const @name@_real position[@NAME@_BODIES], const @name@_real speed[@NAME@_BODIES])
{
    uint32_t i;
    uint32_t k;
    for (i = 0U; i < SIZE; i++) {
        plant.z[i] = R(0.0);
    }
    plant.z[SIZE - 1U] = R(1.0);
    for (i = 0U; i < STATES; i++) {
        plant.carry[i] = R(0.0);
    }
    for (i = 0U; i < @NAME@_BODIES; i++) {
        plant.z[COORDINATE[i]] = position[i];
        plant.z[SPEED[i]] = speed[i];
    }
    for (i = 0U; i < REPLACED; i++) {
        /* A length of the belt stands in the place of a pulley's angle; what rounding makes of it is none. */
        const uint32_t body = REPLACED_BODY[i];
        @name@_real length = REPLACED_ARM[i] * position[body];
        @name@_real size = size_of(length);
        for (k = OTHERS_FIRST[i]; k < OTHERS_FIRST[i + 1U]; k++) {
            const @name@_real part = OTHERS_ARM[k] * position[OTHERS[k]];
            size = (size_of(part) > size) ? size_of(part) : size;
            length += part;
        }
        plant.z[COORDINATE[body]] = (size_of(length) <= (R(4.0) * EPSILON * size)) ? R(0.0) : length;
    }
@hold@    multiply();
    for (i = 0U; i < ELEMENTS; i++) {
        plant.does[i] = AT_REST[i];
        if (ELEMENT_SPEED[i] != NONE) {
            const @name@_real now = plant.z[ELEMENT_SPEED[i]];
            plant.does[i] = (uint8_t)((now > R(0.0)) ? FORWARD : ((now < R(0.0)) ? 0U : STUCK));
        }
    }
    for (i = 0U; i <= SLOTS; i++) {
        plant.tolerance[i] = R(0.0);
        plant.fresh[i] = 0U;
    }
    plant.is_fresh = 0U;
    plant.at_edge = 1U;
    plant.since_change = R(1.0);
    plant.changes = 0U;
    plant.events = 0U;
    begin();
    plant.status = @NAME@_DONE;
    take_up_mode();
    settle();
}

void @name@_reset(void)
{
    static const @name@_real none[@NAME@_BODIES] = {R(0.0)};
    @name@_start(none, none);
}

/* Goes on by what is left, s, until there have been too many events in this step; says what is left then. */
static @name@_status go_on(@name@_real *left)
{
    @name@_real sum = R(0.0);
    uint32_t series = 0U;
    uint32_t i;
    while ((*left > R(0.0)) && (plant.status == @NAME@_DONE)) {
        @name@_real used = R(0.0);
        /* The rest behind the last whole series of a step is of its own length. */
        const uint32_t fallen = advance((*left < (R(1.0000001) * REACH)) ? *left : REACH, &used);
        *left -= used;
        series++;
        if (fallen != NONE) {
            change(fallen);
            if (plant.status == @NAME@_DONE) {
                settle();
            }
        }
        if ((*left > R(0.0)) && (plant.status == @NAME@_DONE) &&
            (series >= @NAME@_SERIES)) {
            plant.status = @NAME@_TOO_MANY_EVENTS;
        }
    }
    for (i = 0U; i < STATES; i++) {
        sum += plant.z[i];
    }
    if (!is_number(sum)) {
        plant.status = @NAME@_NO_NUMBER;
    }
    return plant.status;
}

@name@_status @name@_step(const @name@_real input[@NAME@_DRIVES])
{
    @name@_real left = @NAME@_STEP;
    @name@_status taken;
    if (plant.status == @NAME@_LEFT_TRAVEL) {
        return plant.status;
    }
    plant.status = @NAME@_DONE;
    begin();
    taken = take_input(input);
    return (taken == @NAME@_DONE) ? go_on(&left) : taken;
}

void @name@_read(@name@_output *out)
{
    uint32_t i;
    uint32_t k;
    for (i = 0U; i < @NAME@_BODIES; i++) {
        out->position[i] = plant.z[COORDINATE[i]];
        out->speed[i] = plant.z[SPEED[i]];
        out->motion[i] = 2;
    }
    for (i = 0U; i < REPLACED; i++) {
        @name@_real length = plant.z[COORDINATE[REPLACED_BODY[i]]];
        for (k = OTHERS_FIRST[i]; k < OTHERS_FIRST[i + 1U]; k++) {
            length -= OTHERS_ARM[k] * out->position[OTHERS[k]];
        }
        out->position[REPLACED_BODY[i]] = length / REPLACED_ARM[i];
    }
    for (i = 0U; i < @NAME@_BODIES; i++) {
        if (MOTION_OF[i] != NONE) {
            out->motion[i] = (int8_t)((int32_t)plant.does[MOTION_OF[i]] - 1);
        }
    }
    for (i = 0U; i < @NAME@_DRIVES; i++) {
        out->current[i] = value_of(row_of(CURRENT_TABLE + i, plant.does));
        out->voltage[i] = value_of(row_of(VOLTAGE_TABLE + i, plant.does));
    }
    for (i = 0U; i < @NAME@_SPRINGS; i++) {
        out->force[i] = value_of(row_of(FORCE_TABLE + i, plant.does));
    }
@read@}

uint32_t @name@_events(void) { return plant.events; }
