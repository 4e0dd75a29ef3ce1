/* A controller that pushes in proportion to what is missing of a target volume, and its faults.
 *
 * tests/cosim/foreign.py compiles it into FMUs of FMI 1.0, 2.0 and 3.0. A fault is a macro:
 *   STATUS=n         steps from t = 0.1 s on answer with the status n
 *   INIT_STATUS=n    leaving initialization does
 *   NO_INSTANCE      instantiation gives nothing
 *   NAN_OUTPUT       delta_p is NaN from t = 0.1 s on
 *   HANG, CRASH      at t = 0.1 s it loops for ever, or writes to address 0
 *   ABORT            at t = 0.1 s it logs an error and aborts
 *   QUIT             at t = 0.1 s it ends its process with exit code 7
 *   LOAD_HANG, LOAD_CRASH    it does so while it is instantiated
 *   TERMINATE        at t = 0.1 s it asks to end the simulation
 *   EARLY=share      FMI 3.0: it returns after that share of each step
 *   WARN             each step logs a warning
 *   STEP_LENGTH=h    steps of another length are an error
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef TOKEN
#define TOKEN "{8c4e810f}"
#endif

enum { GAIN, TARGET, VOLUME, DELTA_P, CLOCK, FLOATS };   /* cmH2O/L, L, L, cmH2O, s */
enum { COUNT, STRIDE, LEVEL, WANTED, INTEGERS };         /* COUNT += STRIDE; LEVEL = WANTED */
enum { ON, ENABLED, BOOLEANS };                          /* ON = ENABLED */
enum { IN, OUT, GAINS, ARRAYS };                         /* OUT = GAINS * IN */
enum { MOST = 8 };

typedef struct {
    double real[FLOATS], array[ARRAYS][MOST], reached;
    int integer[INTEGERS], boolean[BOOLEANS], size;
} State;

typedef struct {
    State state;
    void *callbacks, *environment;
    char name[64];
} Model;

static Model *new_model(const char *name, const char *token) {
    Model *m;
    State *s;
    if (strcmp(token, TOKEN)) return NULL;
#ifdef LOAD_HANG
    for (volatile int forever = 1; forever;) {}
#endif
#ifdef LOAD_CRASH
    *(volatile int *)0 = 0;
#endif
#ifdef NO_INSTANCE
    return NULL;
#endif
    m = calloc(1, sizeof(Model));
    s = &m->state;
    snprintf(m->name, sizeof m->name, "%s", name);
    s->real[GAIN] = 5;
    s->real[TARGET] = 3;
    s->integer[STRIDE] = s->integer[LEVEL] = s->integer[WANTED] = 1;
    s->boolean[ENABLED] = 1;
    s->size = 2;
    for (int i = 0; i < MOST; i++) s->array[GAINS][i] = i + 1;
    return m;
}

/* Moves on by h; gives one of FMI's statuses: 0 ok, 2 discard, 3 error, 4 fatal. */
static int move(State *s, double t, double h) {
    int late = t > 0.1 - 1e-9;
    (void)late;
    s->reached = t;
#ifdef STEP_LENGTH
    if (fabs(h - STEP_LENGTH) > 1e-9) return 3;
#endif
#ifdef HANG
    if (late) fputs("hangs\n", stderr);
    for (volatile int forever = late; forever;) {}
#endif
#ifdef CRASH
    if (late) *(volatile int *)0 = 0;
#endif
#ifdef QUIT
    if (late) exit(7);
#endif
#ifdef STATUS
    if (late) return STATUS;
#endif
    s->real[CLOCK] = s->reached = t + h;
    s->real[DELTA_P] = s->real[GAIN] * (s->real[TARGET] - s->real[VOLUME]);
#ifdef NAN_OUTPUT
    if (late) s->real[DELTA_P] = NAN;
#endif
    s->integer[COUNT] += s->integer[STRIDE];
    s->integer[LEVEL] = s->integer[WANTED];
    s->boolean[ON] = s->boolean[ENABLED];
    for (int i = 0; i < s->size; i++) s->array[OUT][i] = s->array[GAINS][i] * s->array[IN][i];
    return 0;
}

#ifdef TERMINATE
#define ENDS(t) ((t) > 0.1 - 1e-9)
#else
#define ENDS(t) 0
#endif

/* Getter and setter of one type, from and to a field of the state. */
#define ACCESS(fmi, Instance, Type, CType, field)                                               \
    int fmi##Get##Type(Instance c, const unsigned v[], size_t n, CType x[]) {                    \
        for (size_t i = 0; i < n; i++) x[i] = (CType)((Model *)c)->state.field[v[i]];            \
        return 0;                                                                                \
    }                                                                                            \
    int fmi##Set##Type(Instance c, const unsigned v[], size_t n, const CType x[]) {              \
        for (size_t i = 0; i < n; i++) ((Model *)c)->state.field[v[i]] = x[i];                   \
        return 0;                                                                                \
    }

/* A function that is there because it has to be, and always fails. */
#define UNUSED(name) int name(void) { return 3; }
