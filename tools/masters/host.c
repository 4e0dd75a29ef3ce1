/* A host without Python: it drives an exported body (FMI 2.0) with 300 Pa, in C.

   softbody export fmu sphere-lung -o body.fmu && unzip body.fmu -d body
   cc tools/masters/host.c -o host -ldl
   LD_PRELOAD=libpython3.11.so ./host body/binaries/linux64/SoftBody.so GUID file://$PWD/body/resources

   GUID is that of body/modelDescription.xml. The libpython is that of the Python in which this
   package is installed; PYTHONHOME and PYTHONPATH lead it there if it is in a virtual environment. */

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

static void print(void *e, const char *name, int status, const char *kind, const char *text, ...)
{
    printf("[%d] %s\n", status, text);
}

int main(int count, char **arguments)
{
    const Callbacks callbacks = {print, calloc, free, NULL, NULL};
    const unsigned delta_p = 0, volume = 2; /* as in modelDescription.xml */
    const double pressure = 300.0;
    double value;
    setvbuf(stdout, NULL, _IONBF, 0); /* a crash at exit would lose what is buffered */
    if (count != 4) {
        printf("usage: %s BINARY GUID RESOURCES\n", arguments[0]);
        return 1;
    }
    void *binary = dlopen(arguments[1], RTLD_NOW);
    if (binary == NULL) {
        printf("%s\n", dlerror());
        return 1;
    }
    void *(*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int) =
        dlsym(binary, "fmi2Instantiate");
    int (*set_up)(void *, int, double, double, int, double) = dlsym(binary, "fmi2SetupExperiment");
    int (*enter)(void *) = dlsym(binary, "fmi2EnterInitializationMode");
    int (*leave)(void *) = dlsym(binary, "fmi2ExitInitializationMode");
    int (*set)(void *, const unsigned *, size_t, const double *) = dlsym(binary, "fmi2SetReal");
    int (*get)(void *, const unsigned *, size_t, double *) = dlsym(binary, "fmi2GetReal");
    int (*step)(void *, double, double, int) = dlsym(binary, "fmi2DoStep");
    int (*terminate)(void *) = dlsym(binary, "fmi2Terminate");
    void (*end)(void *) = dlsym(binary, "fmi2FreeInstance");

    void *body = instantiate("body", 1, arguments[2], arguments[3], &callbacks, 0, 1);
    if (body == NULL || set_up(body, 0, 0.0, 0.0, 0, 0.0) || enter(body) || leave(body)) {
        return 2;
    }
    for (int i = 0; i < 120; i++) {
        if (set(body, &delta_p, 1, &pressure) || step(body, i / 30.0, 1 / 30.0, 1)) {
            return 3;
        }
    }
    get(body, &volume, 1, &value);
    printf("volume after 4 s: %.17g m3\n", value);
    terminate(body);
    end(body);
    return 0;
}
