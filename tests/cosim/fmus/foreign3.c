/* FMI 3.0; see foreign.h. */
#include "foreign.h"

#include "fmi3FunctionTypes.h"

static void say(Model *m, int status, const char *text) {
    ((fmi3LogMessageCallback)m->callbacks)(m->environment, status, "log", text);
}

const char *fmi3GetVersion(void) { return "3.0"; }
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const s[]) { return 0; }
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources,
                                  bool visible, bool logging, bool events, bool early,
                                  const unsigned v[], size_t n, void *environment,
                                  fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback i) {
    Model *m = new_model(name, token);
    if (!m) {
        log(environment, fmi3Error, "log", "unknown instantiation token");
        return NULL;
    }
    m->environment = environment;
    m->callbacks = (void *)log;
    return m;
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3EnterInitializationMode(void *c, bool d, double tolerance, double start, bool s,
                                double stop) {
    ((Model *)c)->state.real[CLOCK] = start;
    return 0;
}
int fmi3ExitInitializationMode(void *c) {
#ifdef INIT_STATUS
    say(c, INIT_STATUS, "the valve is shut");
    return INIT_STATUS;
#endif
    return 0;
}
int fmi3Terminate(void *c) { return 0; }
int fmi3Reset(void *c) { return 0; }
int fmi3EnterConfigurationMode(void *c) { return 0; }
int fmi3ExitConfigurationMode(void *c) { return 0; }

/* Value references: 0 to 9 numbers, from 10 arrays, 20 their size, from 30 integers, from 40
 * booleans; the last digit is the place in the state. */
static int copy(State *s, const unsigned v[], size_t n, double *out, const double *in, size_t all) {
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        double *field = v[i] < 10 ? &s->real[v[i]] : s->array[v[i] - 10];
        for (int j = 0; j < (v[i] < 10 ? 1 : s->size); j++, k++) {
            if (k >= all) return fmi3Error;
            if (in) field[j] = in[k];
            else out[k] = field[j];
        }
    }
    return k == all ? 0 : fmi3Error;
}
int fmi3GetFloat64(void *c, const unsigned v[], size_t n, double x[], size_t all) {
    return copy(&((Model *)c)->state, v, n, x, NULL, all);
}
int fmi3SetFloat64(void *c, const unsigned v[], size_t n, const double x[], size_t all) {
    return copy(&((Model *)c)->state, v, n, NULL, x, all);
}

#define ACCESS3(Type, CType, field)                                                              \
    int fmi3Get##Type(void *c, const unsigned v[], size_t n, CType x[], size_t all) {             \
        for (size_t i = 0; i < n; i++) x[i] = (CType)((Model *)c)->state.field[v[i] % 10];             \
        return 0;                                                                                 \
    }                                                                                             \
    int fmi3Set##Type(void *c, const unsigned v[], size_t n, const CType x[], size_t all) {       \
        for (size_t i = 0; i < n; i++) ((Model *)c)->state.field[v[i] % 10] = (int)x[i];               \
        return 0;                                                                                 \
    }
ACCESS3(Int8, int8_t, integer)     /* count, and the stride of each step */
ACCESS3(Int64, int64_t, integer)   /* enumerations */
ACCESS3(Boolean, bool, boolean)
int fmi3GetUInt64(void *c, const unsigned v[], size_t n, uint64_t x[], size_t all) {
    x[0] = (uint64_t)((Model *)c)->state.size;
    return 0;
}
int fmi3SetUInt64(void *c, const unsigned v[], size_t n, const uint64_t x[], size_t all) {
    ((Model *)c)->state.size = (int)x[0];
    return x[0] <= MOST ? 0 : fmi3Error;
}

int fmi3GetFMUState(void *c, void **kept) {
    if (!*kept) *kept = malloc(sizeof(State));
    memcpy(*kept, &((Model *)c)->state, sizeof(State));
    return 0;
}
int fmi3SetFMUState(void *c, void *kept) {
    memcpy(&((Model *)c)->state, kept, sizeof(State));
    return 0;
}
int fmi3FreeFMUState(void *c, void **kept) {
    free(*kept);
    *kept = NULL;
    return 0;
}
int fmi3SerializedFMUStateSize(void *c, void *kept, size_t *size) {
    *size = sizeof(State);
    return 0;
}
int fmi3SerializeFMUState(void *c, void *kept, uint8_t bytes[], size_t size) {
    memcpy(bytes, kept, size);
    return 0;
}
int fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, void **kept) {
    if (size != sizeof(State)) return fmi3Error;
    if (!*kept) *kept = malloc(size);
    memcpy(*kept, bytes, size);
    return 0;
}

#ifndef NO_STEP
int fmi3DoStep(void *c, double t, double h, bool final, bool *event, bool *ends, bool *early,
               double *reached) {
    Model *m = c;
    int status;
#ifdef EARLY
    if (h > 1e-3) { /* a rest as short as that is done at once */
        h *= EARLY;
        *early = true;
    }
#endif
    status = move(&m->state, t, h);
    *ends = ENDS(t);
    *reached = m->state.reached;
    if (status) say(m, status, "the pump has stopped");
#ifdef WARN
    say(m, fmi3Warning, "the filter is due");
    return fmi3Warning;
#endif
    return status;
}
#endif

UNUSED(fmi3ActivateModelPartition) UNUSED(fmi3CompletedIntegratorStep)
UNUSED(fmi3EnterContinuousTimeMode) UNUSED(fmi3EnterEventMode) UNUSED(fmi3EnterStepMode)
UNUSED(fmi3EvaluateDiscreteStates) UNUSED(fmi3GetAdjointDerivative) UNUSED(fmi3GetBinary)
UNUSED(fmi3GetClock) UNUSED(fmi3GetContinuousStateDerivatives) UNUSED(fmi3GetContinuousStates)
UNUSED(fmi3GetDirectionalDerivative) UNUSED(fmi3GetEventIndicators) UNUSED(fmi3GetFloat32)
UNUSED(fmi3GetInt16) UNUSED(fmi3GetInt32) UNUSED(fmi3GetIntervalDecimal)
UNUSED(fmi3GetIntervalFraction) UNUSED(fmi3GetNominalsOfContinuousStates)
UNUSED(fmi3GetNumberOfContinuousStates) UNUSED(fmi3GetNumberOfEventIndicators)
UNUSED(fmi3GetNumberOfVariableDependencies) UNUSED(fmi3GetOutputDerivatives)
UNUSED(fmi3GetShiftDecimal) UNUSED(fmi3GetShiftFraction) UNUSED(fmi3GetString)
UNUSED(fmi3GetUInt16) UNUSED(fmi3GetUInt32) UNUSED(fmi3GetUInt8)
UNUSED(fmi3GetVariableDependencies) UNUSED(fmi3InstantiateModelExchange)
UNUSED(fmi3InstantiateScheduledExecution) UNUSED(fmi3SetBinary) UNUSED(fmi3SetClock)
UNUSED(fmi3SetContinuousStates) UNUSED(fmi3SetFloat32) UNUSED(fmi3SetInt16) UNUSED(fmi3SetInt32)
UNUSED(fmi3SetIntervalDecimal) UNUSED(fmi3SetIntervalFraction) UNUSED(fmi3SetShiftDecimal)
UNUSED(fmi3SetShiftFraction) UNUSED(fmi3SetString) UNUSED(fmi3SetTime) UNUSED(fmi3SetUInt16)
UNUSED(fmi3SetUInt32) UNUSED(fmi3SetUInt8) UNUSED(fmi3UpdateDiscreteStates)
