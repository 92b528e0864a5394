/*
 * @title@, as an FMU for co-simulation by FMI 3.0: the functions of the standard around instance.c.
 *
 * Written by taut @version@. The headers of the standard are the importer's. The binary in this FMU can do more: model
 * exchange, parameters that are set, steps that end at events, inputs that are polynomials.
 */
#include "fmi3Functions.h"
#include "instance.c"

#define COUNTED(type, name) const fmi3ValueReference references[], size_t count, type name[], size_t values

static void tell(unit *own, int status, const char *message)
{
    fmi3LogMessageCallback logger;
    memcpy(&logger, &own->logger, sizeof logger);
    logger(own->environment, (fmi3Status)status, "logStatusError", message);
}

/* A function on variables of a type, or a kind, that there are none of. */
static fmi3Status none(void *instance, size_t count)
{
    unit *own = instance;
    return (fmi3Status)((count == 0U) ? OK : refuse(own, "there is no variable of this type"));
}

static fmi3Status exchange(void *instance) { return (fmi3Status)refuse(instance, NO_EXCHANGE_HERE); }

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    unit *own = instance;
    (void)count;
    (void)categories;
    own->is_logging = on ? 1 : 0;
    return fmi3OK;
}

/* --- instances --- */

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    if (logging && (log != NULL)) {
        log(environment, fmi3Error, "logStatusError", NO_EXCHANGE_HERE);
    }
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference intermediate[], size_t count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    unit *own = make(name, token, logging ? 1 : 0);
    (void)resources;
    (void)visible;
    (void)intermediate;
    (void)count;
    if (own != NULL) {
        own->environment = environment;
        own->tell = (log != NULL) ? tell : NULL;
        memcpy(&own->logger, &log, sizeof log);
        memcpy(&own->update, &update, sizeof update);
        own->has_events = events ? 1 : 0;
        own->can_return = early ? 1 : 0;
    } else if (logging && (log != NULL)) {
        log(environment, fmi3Error, "logStatusError", "this is not the token of this FMU");
    } else {
        /* nobody listens */
    }
    return own;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)environment;
    (void)log;
    (void)clock;
    (void)lock;
    (void)unlock;
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) { destroy(instance); }

/* --- phases --- */

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    unit *own = instance;
    const int status = set_up(own, has_tolerance ? 1 : 0, tolerance, start, has_stop ? 1 : 0, stop);
    if (status == OK) {
        own->now.phase = INITIALIZING;
    }
    return (fmi3Status)status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    unit *own = instance;
    return (fmi3Status)go_into(own, INITIALIZING, (own->has_events != 0) ? IN_EVENT : STEPPING);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    unit *own = instance;
    if (own->has_events == 0) {
        return (fmi3Status)refuse(own, "event mode was not asked for");
    }
    return (fmi3Status)go_into(own, STEPPING, IN_EVENT);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) { return (fmi3Status)go_into(instance, IN_EVENT, STEPPING); }

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) { return exchange(instance); }

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return (fmi3Status)go_into(instance, IN_EVENT | STEPPING, TERMINATED);
}

fmi3Status fmi3Reset(fmi3Instance instance) { return (fmi3Status)start_over(instance); }

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return (fmi3Status)refuse(instance, "there are no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return (fmi3Status)refuse(instance, "there are no structural parameters");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return (fmi3Status)refuse(instance, "discrete states are those of fmi3UpdateDiscreteStates");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *needed, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *next)
{
    unit *own = instance;
    if (!allows(own, IN_EVENT)) {
        return fmi3Error;
    }
    *needed = false;
    *terminate = false;
    *nominals = false;
    *values = false;
    *defined = false;
    *next = 0.0;
    return fmi3OK;
}

/* --- values --- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, COUNTED(fmi3Float64, into))
{
    unit *own = instance;
    return (fmi3Status)((count == values) ? get(own, references, count, into, NULL) : refuse(own, "one value for each"));
}

fmi3Status fmi3GetInt32(fmi3Instance instance, COUNTED(fmi3Int32, into))
{
    unit *own = instance;
    return (fmi3Status)((count == values) ? get(own, references, count, NULL, into) : refuse(own, "one value for each"));
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, COUNTED(const fmi3Float64, from))
{
    unit *own = instance;
    return (fmi3Status)((count == values) ? set(own, references, from, count) : refuse(own, "one value for each"));
}

#define NO_VARIABLE(function, type)                                         \
    fmi3Status function(fmi3Instance instance, COUNTED(type, list))         \
    {                                                                       \
        (void)references;                                                   \
        (void)list;                                                         \
        (void)values;                                                       \
        return none(instance, count);                                       \
    }

NO_VARIABLE(fmi3GetFloat32, fmi3Float32)
NO_VARIABLE(fmi3GetInt8, fmi3Int8)
NO_VARIABLE(fmi3GetUInt8, fmi3UInt8)
NO_VARIABLE(fmi3GetInt16, fmi3Int16)
NO_VARIABLE(fmi3GetUInt16, fmi3UInt16)
NO_VARIABLE(fmi3GetUInt32, fmi3UInt32)
NO_VARIABLE(fmi3GetInt64, fmi3Int64)
NO_VARIABLE(fmi3GetUInt64, fmi3UInt64)
NO_VARIABLE(fmi3GetBoolean, fmi3Boolean)
NO_VARIABLE(fmi3GetString, fmi3String)
NO_VARIABLE(fmi3SetFloat32, const fmi3Float32)
NO_VARIABLE(fmi3SetInt8, const fmi3Int8)
NO_VARIABLE(fmi3SetUInt8, const fmi3UInt8)
NO_VARIABLE(fmi3SetInt16, const fmi3Int16)
NO_VARIABLE(fmi3SetUInt16, const fmi3UInt16)
NO_VARIABLE(fmi3SetInt32, const fmi3Int32)
NO_VARIABLE(fmi3SetUInt32, const fmi3UInt32)
NO_VARIABLE(fmi3SetInt64, const fmi3Int64)
NO_VARIABLE(fmi3SetUInt64, const fmi3UInt64)
NO_VARIABLE(fmi3SetBoolean, const fmi3Boolean)
NO_VARIABLE(fmi3SetString, const fmi3String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count, size_t sizes[],
                         fmi3Binary list[], size_t values)
{
    (void)references;
    (void)sizes;
    (void)list;
    (void)values;
    return none(instance, count);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                         const size_t sizes[], const fmi3Binary list[], size_t values)
{
    (void)references;
    (void)sizes;
    (void)list;
    (void)values;
    return none(instance, count);
}

#define NO_CLOCK(function, type)                                                                              \
    fmi3Status function(fmi3Instance instance, const fmi3ValueReference references[], size_t count, type list[]) \
    {                                                                                                         \
        (void)references;                                                                                     \
        (void)list;                                                                                           \
        return none(instance, count);                                                                         \
    }

#define NO_FRACTION(function, type)                                                                           \
    fmi3Status function(fmi3Instance instance, const fmi3ValueReference references[], size_t count, type list[], \
                        type over[])                                                                          \
    {                                                                                                         \
        (void)references;                                                                                     \
        (void)list;                                                                                           \
        (void)over;                                                                                           \
        return none(instance, count);                                                                         \
    }

NO_CLOCK(fmi3GetClock, fmi3Clock)
NO_CLOCK(fmi3SetClock, const fmi3Clock)
NO_CLOCK(fmi3GetShiftDecimal, fmi3Float64)
NO_CLOCK(fmi3SetIntervalDecimal, const fmi3Float64)
NO_CLOCK(fmi3SetShiftDecimal, const fmi3Float64)
NO_FRACTION(fmi3GetShiftFraction, fmi3UInt64)
NO_FRACTION(fmi3SetIntervalFraction, const fmi3UInt64)
NO_FRACTION(fmi3SetShiftFraction, const fmi3UInt64)

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                  fmi3Float64 list[], fmi3IntervalQualifier qualifiers[])
{
    (void)references;
    (void)list;
    (void)qualifiers;
    return none(instance, count);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                   fmi3UInt64 list[], fmi3UInt64 over[], fmi3IntervalQualifier qualifiers[])
{
    (void)references;
    (void)list;
    (void)over;
    (void)qualifiers;
    return none(instance, count);
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference reference, size_t *count)
{
    (void)reference;
    (void)count;
    return (fmi3Status)refuse(instance, "dependencies are those of modelDescription.xml");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent, size_t elements[],
                                       fmi3ValueReference independents[], size_t others[],
                                       fmi3DependencyKind kinds[], size_t count)
{
    (void)dependent;
    (void)elements;
    (void)independents;
    (void)others;
    (void)kinds;
    (void)count;
    return (fmi3Status)refuse(instance, "dependencies are those of modelDescription.xml");
}

/* --- states and derivatives --- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state) { return (fmi3Status)keep(instance, state); }

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) { return (fmi3Status)bring_back(instance, state); }

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state) { return (fmi3Status)let_go(instance, state); }

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    return (fmi3Status)bytes_of(instance, state, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return (fmi3Status)write_out(instance, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    return (fmi3Status)read_in(instance, bytes, size, state);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t count,
                                        const fmi3ValueReference knowns[], size_t changed, const fmi3Float64 seed[],
                                        size_t seeds, fmi3Float64 into[], size_t values)
{
    unit *own = instance;
    if ((count != values) || (changed != seeds)) {
        return (fmi3Status)refuse(own, "one value for each");
    }
    return (fmi3Status)directional(own, unknowns, count, knowns, changed, seed, into);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t count,
                                    const fmi3ValueReference knowns[], size_t changed, const fmi3Float64 seed[],
                                    size_t seeds, fmi3Float64 into[], size_t values)
{
    (void)unknowns;
    (void)count;
    (void)knowns;
    (void)changed;
    (void)seed;
    (void)seeds;
    (void)into;
    (void)values;
    return (fmi3Status)refuse(instance, "there are directional derivatives, and no adjoint ones");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                    const fmi3Int32 orders[], fmi3Float64 into[], size_t values)
{
    unit *own = instance;
    if (count != values) {
        return (fmi3Status)refuse(own, "one value for each");
    }
    return (fmi3Status)output_derivatives(own, references, orders, into, count);
}

/* --- model exchange --- */

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean before, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    (void)before;
    (void)event;
    (void)terminate;
    return exchange(instance);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    (void)time;
    return exchange(instance);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[], size_t count)
{
    (void)states;
    (void)count;
    return exchange(instance);
}

#define NO_EXCHANGE(function)                                                            \
    fmi3Status function(fmi3Instance instance, fmi3Float64 states[], size_t count)       \
    {                                                                                    \
        (void)states;                                                                    \
        (void)count;                                                                     \
        return exchange(instance);                                                       \
    }

NO_EXCHANGE(fmi3GetContinuousStateDerivatives)
NO_EXCHANGE(fmi3GetEventIndicators)
NO_EXCHANGE(fmi3GetContinuousStates)
NO_EXCHANGE(fmi3GetNominalsOfContinuousStates)

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count)
{
    (void)count;
    return exchange(instance);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count)
{
    (void)count;
    return exchange(instance);
}

/* --- steps --- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 current, fmi3Float64 size, fmi3Boolean before,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    unit *own = instance;
    fmi3IntermediateUpdateCallback update;
    double end = current;
    int status = ERROR;
    (void)before;
    *event = false;
    *terminate = false;
    *early = false;
    *last = own->now.time;
    if (!allows(own, STEPPING) || !can_step(own, current, size, &end)) {
        return fmi3Error;
    }
    status = go(own, end);
    *terminate = own->now.is_over != 0U;
    *early = own->now.time < end;
    *last = own->now.time;
    memcpy(&update, &own->update, sizeof update);
    if ((status == OK) && (update != NULL)) {
        fmi3Boolean wants = false;
        fmi3Float64 when = own->now.time;
        update(own->environment, own->now.time, false, true, true, false, &wants, &when);
    }
    return (fmi3Status)status;
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock;
    (void)time;
    return (fmi3Status)refuse(instance, "there is no scheduled execution");
}
