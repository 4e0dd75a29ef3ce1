/* FMI 2.0; see foreign.h. */
#include "foreign.h"

#include "fmi2FunctionTypes.h"

static void say(Model *m, int status, const char *text) {
    const fmi2CallbackFunctions *f = m->callbacks;
    f->logger(f->componentEnvironment, m->name, status, "log", "%s at t = %g s", text,
              m->state.real[CLOCK]);
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

void *fmi2Instantiate(const char *name, fmi2Type type, const char *token, const char *resources,
                      const fmi2CallbackFunctions *f, int visible, int logging) {
    Model *m = new_model(name, token);
    if (m) m->callbacks = (void *)f;
    else f->logger(f->componentEnvironment, name, fmi2Error, "log", "unknown GUID %s", token);
    return m;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const s[]) { return 0; }
int fmi2SetupExperiment(void *c, int d, double tolerance, double start, int s, double stop) {
    ((Model *)c)->state.real[CLOCK] = start;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { return 0; }
int fmi2ExitInitializationMode(void *c) {
#ifdef INIT_STATUS
    say(c, INIT_STATUS, "the valve is shut");
    return INIT_STATUS;
#endif
    return 0;
}
int fmi2Terminate(void *c) { return 0; }
int fmi2Reset(void *c) { return 0; }

ACCESS(fmi2, void *, Real, double, real)
ACCESS(fmi2, void *, Integer, int, integer)
ACCESS(fmi2, void *, Boolean, int, boolean)
UNUSED(fmi2GetString)
UNUSED(fmi2SetString)

int fmi2GetFMUstate(void *c, void **kept) {
#ifdef NO_STATE
    return 3;
#endif
    if (!*kept) *kept = malloc(sizeof(State));
    memcpy(*kept, &((Model *)c)->state, sizeof(State));
    return 0;
}
int fmi2SetFMUstate(void *c, void *kept) {
    memcpy(&((Model *)c)->state, kept, sizeof(State));
    return 0;
}
int fmi2FreeFMUstate(void *c, void **kept) {
    free(*kept);
    *kept = NULL;
    return 0;
}
int fmi2SerializedFMUstateSize(void *c, void *kept, size_t *size) {
    *size = sizeof(State);
    return 0;
}
int fmi2SerializeFMUstate(void *c, void *kept, char bytes[], size_t size) {
    memcpy(bytes, kept, size);
    return 0;
}
int fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t size, void **kept) {
    if (size != sizeof(State)) return 3;
    if (!*kept) *kept = malloc(size);
    memcpy(*kept, bytes, size);
    return 0;
}

#ifndef NO_STEP
int fmi2DoStep(void *c, double t, double h, int final) {
    int status;
#ifdef ABORT
    if (t > 0.1 - 1e-9) {
        say(c, fmi2Error, "the shaft is broken");
        abort();
    }
#endif
    status = move(&((Model *)c)->state, t, h);
    if (status) say(c, status, "the pump has stopped");
#ifdef WARN
    say(c, fmi2Warning, "the filter is due");
    return fmi2Warning;
#endif
    return ENDS(t) ? fmi2Discard : status;
}
#endif
int fmi2GetRealStatus(void *c, int kind, double *value) {
    *value = ((Model *)c)->state.reached;
    return 0;
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    *value = kind == fmi2Terminated && ENDS(((Model *)c)->state.reached);
    return 0;
}
UNUSED(fmi2GetStatus)
UNUSED(fmi2GetIntegerStatus)
UNUSED(fmi2GetStringStatus)
UNUSED(fmi2CancelStep)
UNUSED(fmi2GetDirectionalDerivative)
UNUSED(fmi2SetRealInputDerivatives)
UNUSED(fmi2GetRealOutputDerivatives)
