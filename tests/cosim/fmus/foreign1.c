/* FMI 1.0, whose functions bear the model's name; see foreign.h. */
#include "foreign.h"

#include "fmi1Functions.h"

#define NAMED(name) Foreign_fmi##name

static void say(Model *m, int status, const char *text) {
    fmi1CallbackFunctions *f = m->callbacks;
    f->logger(m, m->name, status, "log", "%s at t = %g s", text, m->state.real[CLOCK]);
}

const char *NAMED(GetTypesPlatform)(void) { return "standard32"; }
const char *NAMED(GetVersion)(void) { return "1.0"; }

void *NAMED(InstantiateSlave)(const char *name, const char *token, const char *place,
                              const char *mime, double timeout, char visible, char interactive,
                              fmi1CallbackFunctions f, char logging) {
    Model *m = new_model(name, token);
    if (!m) {
        f.logger(NULL, name, fmi1Error, "log", "unknown GUID %s", token);
        return NULL;
    }
    m->callbacks = malloc(sizeof f);
    memcpy(m->callbacks, &f, sizeof f);
    return m;
}
void NAMED(FreeSlaveInstance)(void *c) {
    free(((Model *)c)->callbacks);
    free(c);
}
int NAMED(SetDebugLogging)(void *c, char on) { return 0; }
int NAMED(InitializeSlave)(void *c, double start, char defined, double stop) {
    ((Model *)c)->state.real[CLOCK] = start;
#ifdef INIT_STATUS
    say(c, INIT_STATUS, "the valve is shut");
    return INIT_STATUS;
#endif
    return 0;
}
int NAMED(TerminateSlave)(void *c) { return 0; }
int NAMED(ResetSlave)(void *c) { return 0; }

ACCESS(Foreign_fmi, void *, Real, double, real)
ACCESS(Foreign_fmi, void *, Integer, int, integer)
ACCESS(Foreign_fmi, void *, Boolean, char, boolean)
UNUSED(NAMED(GetString))
UNUSED(NAMED(SetString))

int NAMED(DoStep)(void *c, double t, double h, char new_step) {
    int status = move(&((Model *)c)->state, t, h);
    if (status) say(c, status, "the pump has stopped");
#ifdef WARN
    say(c, fmi1Warning, "the filter is due");
    return fmi1Warning;
#endif
    return status;
}
int NAMED(GetRealStatus)(void *c, int kind, double *value) {
    *value = ((Model *)c)->state.reached;
    return 0;
}
UNUSED(NAMED(GetStatus))
UNUSED(NAMED(GetIntegerStatus))
UNUSED(NAMED(GetBooleanStatus))
UNUSED(NAMED(GetStringStatus))
UNUSED(NAMED(CancelStep))
UNUSED(NAMED(SetRealInputDerivatives))
UNUSED(NAMED(GetRealOutputDerivatives))
