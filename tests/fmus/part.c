/* A part for tests, an FMU of version FMI (2 or 3) for co-simulation and model exchange:

       x' = v,   v' = g - k x - d v + u + s,

   s grows by `rise` at every multiple of `every` (0: never); where x comes down to the floor 0 it bounces, v = -e v, and `hits` counts.
   Co-simulation takes Euler's steps of 1 ms. `fault`, from t = 0.5 on: 1 error, 2 discard, 3 fatal, 4 a crash, 5 exit(0), 6 a warning,
   7 an end; 8 no instance. From the start on: 9 its next event is always now, 10 an event behind every step, 11 it begins with a jump to
   x = 3. Derivatives are known of the states' and of outputs. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double t, x, v, u, g, k, d, s, rise, every, e, next;
    int32_t hits, fault;
    char word[32];
    int exchange;
    void *environment;
    void (*logger)(void);
} Part;

enum { TIME, X, DX, V, DV, U, G, K, D, S, RISE, EVERY, E, HITS, FAULT, WORD, ENERGY };
enum { OK, WARNING, DISCARD, ERROR, FATAL };

#define EXPORT __attribute__((visibility("default")))

static double accelerates(const Part *p) { return p->g - p->k * p->x - p->d * p->v + p->u + p->s; }

static void tell(Part *p, int status, const char *said, double at) {
#if FMI == 2
    typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
    ((Logger)p->logger)(p->environment, "part", status, "events", "%s at t = %g (%d)", said, at, 42);
#else
    typedef void (*Logger)(void *, int, const char *, const char *);
    char text[200];
    snprintf(text, sizeof text, "%s at t = %g (%d)", said, at, 42);
    ((Logger)p->logger)(p->environment, status, "events", text);
#endif
}

static double *number(Part *p, uint32_t vr) {
    switch (vr) {
    case TIME: return &p->t;
    case X: return &p->x;
    case DX: case V: return &p->v;
    case U: return &p->u;
    case G: return &p->g;
    case K: return &p->k;
    case D: return &p->d;
    case S: return &p->s;
    case RISE: return &p->rise;
    case EVERY: return &p->every;
    case E: return &p->e;
    default: return NULL;
    }
}

static int get(Part *p, const uint32_t vr[], size_t n, double values[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == DV) values[i] = accelerates(p);
        else if (vr[i] == ENERGY) values[i] = 0.5 * (p->v * p->v + p->k * p->x * p->x);
        else if (number(p, vr[i])) values[i] = *number(p, vr[i]);
        else return ERROR;
    }
    return OK;
}

static int set(Part *p, const uint32_t vr[], size_t n, const double values[]) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == DV || vr[i] == DX || !number(p, vr[i])) return ERROR;
        *number(p, vr[i]) = values[i];
    }
    return OK;
}

static int32_t *whole(Part *p, uint32_t vr) { return vr == HITS ? &p->hits : vr == FAULT ? &p->fault : NULL; }

static int get_whole(Part *p, const uint32_t vr[], size_t n, int32_t values[]) {
    for (size_t i = 0; i < n; i++)
        if (whole(p, vr[i])) values[i] = *whole(p, vr[i]); else return ERROR;
    return OK;
}

static int set_whole(Part *p, const uint32_t vr[], size_t n, const int32_t values[]) {
    for (size_t i = 0; i < n; i++)
        if (whole(p, vr[i])) *whole(p, vr[i]) = values[i]; else return ERROR;
    return OK;
}

static int event(Part *p) {
    int moved = 0;
    if (p->fault == 11 && p->hits == 0) {
        p->x = 3;
        p->hits = 1;
        moved = 1;
    }
    if (p->x <= 0 && p->v < 0) {
        p->x = 0;
        p->v = -p->e * p->v;
        p->hits++;
        moved = 1;
    }
    if (p->every > 0 && p->t >= p->next - 1e-9) {
        p->s += p->rise;
        p->next += p->every;
    }
    return moved;
}

static int faults(Part *p, double until, int *ends) {
    *ends = 0;
    if (until < 0.5 || !p->fault) return OK;
    switch (p->fault) {
    case 1: tell(p, ERROR, "the part is broken", p->t); return ERROR;
    case 2: return DISCARD;
    case 3: tell(p, FATAL, "the part is beyond repair", p->t); return FATAL;
    case 4: *(volatile int *)8 = 1; return OK;
    case 5: exit(0);
    case 6: tell(p, WARNING, "the part is warm", p->t); return WARNING;
    case 7: *ends = 1; return OK;
    default: return OK;
    }
}

static int step(Part *p, double t, double h, int *ends) {
    int status = faults(p, t + h, ends);
    if (status >= DISCARD) return status;
    long steps = lround(h / 1e-3);
    if (steps < 1) steps = 1;
    for (long i = 0; i < steps; i++) {
        double a = accelerates(p);
        p->x += h / steps * p->v;
        p->v += h / steps * a;
        p->t = t + (i + 1) * h / steps;
        event(p);
    }
    return status;
}

static Part *made(const char *token, void (*logger)(void), void *environment, int exchange) {
    Part *p = calloc(1, sizeof *p);
    p->logger = logger;
    p->environment = environment;
    p->exchange = exchange;
    p->x = 1;
    p->k = 4;
    p->e = 0.8;
    if (strcmp(token, "{part}")) {
        tell(p, ERROR, "the token is another one's", 0);
        free(p);
        return NULL;
    }
    return p;
}

static int begin(Part *p, double t) {
    p->t = t;
    p->next = p->every;
    if (p->fault == 8) {
        tell(p, ERROR, "it does not begin", t);
        return ERROR;
    }
    return OK;
}

static int directional(Part *p, const uint32_t of[], size_t m, const uint32_t by[], size_t n, const double seed[], double out[]) {
    for (size_t i = 0; i < m; i++) {
        if (of[i] != DX && of[i] != DV && of[i] != X && of[i] != V && of[i] != ENERGY) return ERROR;
        out[i] = 0;
        for (size_t j = 0; j < n; j++) {
            double d = of[i] == by[j];
            if (of[i] == DX) d = by[j] == V;
            if (of[i] == DV) d = by[j] == X ? -p->k : by[j] == V ? -p->d : by[j] == U;
            if (of[i] == ENERGY) d = by[j] == X ? p->k * p->x : by[j] == V ? p->v : 0;
            out[i] += d * seed[j];
        }
    }
    return OK;
}

static int continuous(Part *p, double x[], size_t n) {
    if (n != 2) return ERROR;
    x[0] = p->x;
    x[1] = p->v;
    return OK;
}

static int put(Part *p, const double x[], size_t n) {
    if (n != 2) return ERROR;
    p->x = x[0];
    p->v = x[1];
    return OK;
}

static int rates(Part *p, double dx[], size_t n) {
    int ends;
    if (n != 2) return ERROR;
    dx[0] = p->v;
    dx[1] = accelerates(p);
    return p->fault == 1 || p->fault == 4 || p->fault == 5 ? faults(p, p->t, &ends) : OK;
}

static int indicate(Part *p, double z[], size_t n) {
    if (n != 1) return ERROR;
    z[0] = p->x;
    return OK;
}

static int keep(Part *p, void **state) {
    if (!*state) *state = malloc(sizeof *p);
    memcpy(*state, p, sizeof *p);
    return OK;
}

static int put_back(Part *p, void *state) {
    memcpy(p, state, sizeof *p);
    return OK;
}

static int forget(void **state) {
    free(*state);
    *state = NULL;
    return OK;
}

#define P ((Part *)c)
#if FMI == 2
typedef int B;
typedef struct { B again, ends, nominals, values, defined; double next; } Info;
typedef struct { void (*logger)(void); void *allocate, *free, *finished, *environment; } Callbacks;
#define F(name) EXPORT int fmi2##name
EXPORT void *fmi2Instantiate(const char *name, int kind, const char *token, const char *resources, const Callbacks *with, B visible, B logs) {
    (void)name, (void)resources, (void)visible, (void)logs;
    return made(token, with->logger, with->environment, kind == 0);
}
EXPORT void fmi2FreeInstance(void *c) { free(c); }
F(SetupExperiment)(void *c, B has, double near, double t, B ends, double stop) { (void)has, (void)near, (void)ends, (void)stop; return begin(P, t); }
F(EnterInitializationMode)(void *c) { (void)c; return OK; }
F(GetReal)(void *c, const uint32_t vr[], size_t n, double values[]) { return get(P, vr, n, values); }
F(SetReal)(void *c, const uint32_t vr[], size_t n, const double values[]) { return set(P, vr, n, values); }
F(GetInteger)(void *c, const uint32_t vr[], size_t n, int values[]) { return get_whole(P, vr, n, values); }
F(SetInteger)(void *c, const uint32_t vr[], size_t n, const int values[]) { return set_whole(P, vr, n, values); }
F(SetString)(void *c, const uint32_t vr[], size_t n, const char *const values[]) {
    if (n != 1 || vr[0] != WORD) return ERROR;
    snprintf(P->word, sizeof P->word, "%s", values[0]);
    return OK;
}
F(DoStep)(void *c, double t, double h, B stays) {
    int ends, status = step(P, t, h, &ends);
    (void)stays;
    return ends ? DISCARD : status;
}
F(GetRealStatus)(void *c, int kind, double *value) { (void)kind; *value = P->t; return OK; }
F(GetBooleanStatus)(void *c, int kind, B *value) { (void)kind; *value = P->fault == 7; return OK; }
F(GetFMUstate)(void *c, void **state) { return keep(P, state); }
F(SetFMUstate)(void *c, void *state) { return put_back(P, state); }
F(FreeFMUstate)(void *c, void **state) { (void)c; return forget(state); }
F(GetDirectionalDerivative)(void *c, const uint32_t of[], size_t m, const uint32_t by[], size_t n, const double seed[], double out[]) {
    return directional(P, of, m, by, n, seed, out);
}
F(NewDiscreteStates)(void *c, Info *info) {
    memset(info, 0, sizeof *info);
    info->values = event(P);
    info->defined = P->every > 0 || P->fault == 9;
    info->next = P->fault == 9 ? P->t : P->next;
    return OK;
}
F(CompletedIntegratorStep)(void *c, B stays, B *event, B *ends) { (void)stays; *event = P->fault == 10; *ends = P->fault == 7 && P->t > 0.5; return OK; }
F(GetDerivatives)(void *c, double dx[], size_t n) { return rates(P, dx, n); }
#else
typedef uint8_t B;
#define F(name) EXPORT int fmi3##name
EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, B visible, B logs, B events, B early, const uint32_t *vr, size_t n, void *environment, void (*logger)(void), void *update) {
    (void)name, (void)resources, (void)visible, (void)logs, (void)events, (void)early, (void)vr, (void)n, (void)update;
    return made(token, logger, environment, 0);
}
EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, B visible, B logs, void *environment, void (*logger)(void)) {
    (void)name, (void)resources, (void)visible, (void)logs;
    return made(token, logger, environment, 1);
}
EXPORT void fmi3FreeInstance(void *c) { free(c); }
F(EnterInitializationMode)(void *c, B has, double near, double t, B ends, double stop) { (void)has, (void)near, (void)ends, (void)stop; return begin(P, t); }
F(GetFloat64)(void *c, const uint32_t vr[], size_t n, double values[], size_t m) { return n == m ? get(P, vr, n, values) : ERROR; }
F(SetFloat64)(void *c, const uint32_t vr[], size_t n, const double values[], size_t m) { return n == m ? set(P, vr, n, values) : ERROR; }
F(GetInt32)(void *c, const uint32_t vr[], size_t n, int32_t values[], size_t m) { return n == m ? get_whole(P, vr, n, values) : ERROR; }
F(SetInt32)(void *c, const uint32_t vr[], size_t n, const int32_t values[], size_t m) { return n == m ? set_whole(P, vr, n, values) : ERROR; }
F(SetString)(void *c, const uint32_t vr[], size_t n, const char *const values[], size_t m) {
    if (n != 1 || m != 1 || vr[0] != WORD) return ERROR;
    snprintf(P->word, sizeof P->word, "%s", values[0]);
    return OK;
}
F(DoStep)(void *c, double t, double h, B stays, B *event, B *ends, B *early, double *last) {
    int end, status = step(P, t, h, &end);
    (void)stays;
    *event = *early = 0;
    *ends = end;
    *last = P->t;
    return status;
}
F(GetFMUState)(void *c, void **state) { return keep(P, state); }
F(SetFMUState)(void *c, void *state) { return put_back(P, state); }
F(FreeFMUState)(void *c, void **state) { (void)c; return forget(state); }
F(GetDirectionalDerivative)(void *c, const uint32_t of[], size_t m, const uint32_t by[], size_t n, const double seed[], size_t ns, double out[], size_t no) {
    return ns == n && no == m ? directional(P, of, m, by, n, seed, out) : ERROR;
}
F(UpdateDiscreteStates)(void *c, B *again, B *ends, B *nominals, B *values, B *defined, double *next) {
    *again = *ends = *nominals = 0;
    *values = event(P);
    *defined = P->every > 0 || P->fault == 9;
    *next = P->fault == 9 ? P->t : P->next;
    return OK;
}
F(CompletedIntegratorStep)(void *c, B stays, B *event, B *ends) { (void)stays; *event = P->fault == 10; *ends = P->fault == 7 && P->t > 0.5; return OK; }
F(GetContinuousStateDerivatives)(void *c, double dx[], size_t n) { return rates(P, dx, n); }
#endif
F(ExitInitializationMode)(void *c) { (void)c; return OK; }
F(Terminate)(void *c) { (void)c; return OK; }
F(EnterEventMode)(void *c) { (void)c; return OK; }
F(EnterContinuousTimeMode)(void *c) { (void)c; return OK; }
F(SetTime)(void *c, double t) { P->t = t; return OK; }
F(SetContinuousStates)(void *c, const double x[], size_t n) { return put(P, x, n); }
F(GetContinuousStates)(void *c, double x[], size_t n) { return continuous(P, x, n); }
F(GetEventIndicators)(void *c, double z[], size_t n) { return indicate(P, z, n); }
