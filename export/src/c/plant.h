/* The plant: @title@. */

/* Bodies, drives and springs, by the numbers that the functions take. */
@numbers@

/* Outputs of the plant, in SI units. */
typedef struct {
    @name@_real position[@NAME@_BODIES]; /* rad or m */
    @name@_real speed[@NAME@_BODIES];    /* rad/s or m/s */
    @name@_real current[@NAME@_DRIVES];  /* A */
    @name@_real voltage[@NAME@_DRIVES];  /* V at the motor's terminals */
@outputs@    @name@_real force[@NAME@_SPRINGS];   /* N or N m; of a belt's span beyond its pretension */
    int8_t motion[@NAME@_BODIES];        /* -1 backward, 0 stuck, 1 forward, 2 free */
} @name@_output;

/* How a step ended. */
typedef enum {
    @NAME@_DONE = 0,
    @NAME@_TOO_MANY_EVENTS = 1, /* more than @NAME@_EVENTS in one step: the rest of the step is left out */
    @NAME@_LEFT_TRAVEL = 2,     /* the cart left its travel; it stays where that was */
    @NAME@_NO_NUMBER = 3@more@       /* an input that is no finite number: nothing was done; or a state that became none */
@statuses@} @name@_status;

/* Events that one step may have, and Taylor series. */
#define @NAME@_EVENTS @events@U
#define @NAME@_SERIES @series@U
/* Bounds of what @name@_step computes, from the limits of its loops: products and quotients, sums and differences. */
#define @NAME@_PRODUCTS @products@UL
#define @NAME@_SUMS @sums@UL
/* Step, s. */
#define @NAME@_STEP @step@

/* At rest at the origin, @idle@. Call this, or @name@_start, before anything else. */
void @name@_reset(void);

/* At these positions and speeds, @currents@. */
void @name@_start(const @name@_real position[@NAME@_BODIES], const @name@_real speed[@NAME@_BODIES]);

/* One step with the commands of the drives held. */
@name@_status @name@_step(const @name@_real input[@NAME@_DRIVES]);

/* Its outputs now. */
void @name@_read(@name@_output *out);

/* Events (a body that starts to slide, stops or turns; a limit, a span or a stop that changes) since the start. */
uint32_t @name@_events(void);
