/*
 * @title@, as an FMU for co-simulation by FMI 2.0: the functions of the standard around instance.c.
 *
 * Written by taut @version@. The headers of the standard are the importer's. The binary in this FMU can do more: model
 * exchange, parameters that are set, inputs that are polynomials of higher orders.
 */
#include "fmi2Functions.h"
#include "instance.c"

static void tell(unit *own, int status, const char *message)
{
    fmi2CallbackLogger logger;
    memcpy(&logger, &own->logger, sizeof logger);
    logger(own->environment, own->name, (fmi2Status)status, "logStatusError", "%s", message);
}

static fmi2Status exchange(void *instance) { return (fmi2Status)refuse(instance, NO_EXCHANGE_HERE); }

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    unit *own = c;
    (void)count;
    (void)categories;
    own->is_logging = on;
    return fmi2OK;
}

/* --- instances --- */

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type kind, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    unit *own = (kind == fmi2CoSimulation) ? make(name, token, logging) : NULL;
    (void)resources;
    (void)visible;
    if ((functions != NULL) && (functions->logger != NULL)) {
        if (own != NULL) {
            own->environment = functions->componentEnvironment;
            own->tell = tell;
            memcpy(&own->logger, &functions->logger, sizeof own->logger);
        } else if (logging != 0) {
            functions->logger(functions->componentEnvironment, name, fmi2Error, "logStatusError", "%s",
                              (kind == fmi2CoSimulation) ? "this is not the token of this FMU"
                                                         : NO_EXCHANGE_HERE);
        } else {
            /* nobody listens */
        }
    }
    return own;
}

void fmi2FreeInstance(fmi2Component c) { destroy(c); }

/* --- phases --- */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop)
{
    return (fmi2Status)set_up(c, has_tolerance, tolerance, start, has_stop, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (fmi2Status)go_into(c, INSTANTIATED, INITIALIZING); }

fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (fmi2Status)go_into(c, INITIALIZING, STEPPING); }

fmi2Status fmi2Terminate(fmi2Component c) { return (fmi2Status)go_into(c, STEPPING, TERMINATED); }

fmi2Status fmi2Reset(fmi2Component c) { return (fmi2Status)start_over(c); }

/* --- values --- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Real into[])
{
    return (fmi2Status)get(c, vr, count, into, NULL);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t count, fmi2Integer into[])
{
    return (fmi2Status)get(c, vr, count, NULL, into);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t count, const fmi2Real from[])
{
    return (fmi2Status)set(c, vr, from, count);
}

#define NO_VARIABLE(function, type)                                                                        \
    fmi2Status function(fmi2Component c, const fmi2ValueReference vr[], size_t count, type list[])         \
    {                                                                                                      \
        (void)vr;                                                                                          \
        (void)list;                                                                                        \
        return (fmi2Status)((count == 0U) ? OK : refuse(c, "there is no variable of this type"));          \
    }

NO_VARIABLE(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLE(fmi2GetString, fmi2String)
NO_VARIABLE(fmi2SetInteger, const fmi2Integer)
NO_VARIABLE(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLE(fmi2SetString, const fmi2String)

/* --- states and derivatives --- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return (fmi2Status)keep(c, state); }

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return (fmi2Status)bring_back(c, state); }

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return (fmi2Status)let_go(c, state); }

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    return (fmi2Status)bytes_of(c, state, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return (fmi2Status)write_out(c, state, (unsigned char *)bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    return (fmi2Status)read_in(c, (const unsigned char *)bytes, size, state);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t count,
                                        const fmi2ValueReference knowns[], size_t changed, const fmi2Real seed[],
                                        fmi2Real into[])
{
    return (fmi2Status)directional(c, unknowns, count, knowns, changed, seed, into);
}

/* Lets inputs rise at a rate. */
static int set_slopes(unit *own, const uint32_t references[], const int orders[], const double values[], size_t count)
{
    size_t k;
    for (k = 0U; k < count; k++) {
        const variable *of = variable_of(references[k]);
        if ((of == NULL) || (of->role != INPUT) || (INPUT_DRIVE[of->index] == NONE) || !is_number(values[k])) {
            return refuse(own, "finite derivatives of inputs can be set");
        }
        if ((orders[k] < 1) || ((orders[k] > 1) && ((values[k] < 0.0) || (values[k] > 0.0)))) {
            return refuse(own, "inputs of these sources rise at a rate: derivatives of order 1");
        }
    }
    for (k = 0U; k < count; k++) {
        const variable *of = variable_of(references[k]);
        if (orders[k] == 1) {
            own->now.input[of->index] = input_now(own, of->index);
            own->now.since[of->index] = own->now.time;
            own->now.slope[of->index] = values[k];
            own->now.is_set = 1U;
        }
    }
    return OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                       const fmi2Integer orders[], const fmi2Real values[])
{
    unit *own = c;
    if (!allows(own, INSTANTIATED | INITIALIZING | STEPPING)) {
        return fmi2Error;
    }
    if ((count > 0U) && ((vr == NULL) || (orders == NULL) || (values == NULL))) {
        return (fmi2Status)refuse(own, "a null pointer was given");
    }
    return (fmi2Status)set_slopes(own, vr, orders, values, count);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t count,
                                        const fmi2Integer orders[], fmi2Real into[])
{
    return (fmi2Status)output_derivatives(c, vr, orders, into, count);
}

/* --- model exchange --- */

fmi2Status fmi2EnterEventMode(fmi2Component c) { return exchange(c); }

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    (void)info;
    return exchange(c);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return exchange(c); }

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean before, fmi2Boolean *event, fmi2Boolean *terminate)
{
    (void)before;
    (void)event;
    (void)terminate;
    return exchange(c);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    (void)time;
    return exchange(c);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t count)
{
    (void)x;
    (void)count;
    return exchange(c);
}

#define NO_EXCHANGE(function)                                                \
    fmi2Status function(fmi2Component c, fmi2Real x[], size_t count)         \
    {                                                                        \
        (void)x;                                                             \
        (void)count;                                                         \
        return exchange(c);                                                  \
    }

NO_EXCHANGE(fmi2GetDerivatives)
NO_EXCHANGE(fmi2GetEventIndicators)
NO_EXCHANGE(fmi2GetContinuousStates)
NO_EXCHANGE(fmi2GetNominalsOfContinuousStates)

/* --- steps --- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real current, fmi2Real size, fmi2Boolean before)
{
    unit *own = c;
    double end = current;
    int status = ERROR;
    (void)before;
    if (!allows(own, STEPPING) || !can_step(own, current, size, &end)) {
        return fmi2Error;
    }
    status = go(own, end);
    if ((status == OK) && (own->now.is_over != 0U)) {
        status = says(own, DISCARD, "the cart left its travel: the run ends there");
    }
    return (fmi2Status)status;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return (fmi2Status)refuse(c, "steps end before they return"); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind;
    (void)value;
    return (fmi2Status)refuse(c, "steps end before they return");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    unit *own = c;
    if (kind != fmi2LastSuccessfulTime) {
        return (fmi2Status)refuse(own, "there is the last successful time");
    }
    *value = own->now.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)kind;
    (void)value;
    return (fmi2Status)refuse(c, "there is no such status");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    unit *own = c;
    if (kind != fmi2Terminated) {
        return (fmi2Status)refuse(own, "there is whether the run is over");
    }
    *value = own->now.is_over;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)kind;
    (void)value;
    return (fmi2Status)refuse(c, "there is no such status");
}
