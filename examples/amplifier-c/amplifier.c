/* A switching current amplifier in C: takes the simulated amplifier's place in an anhyst run. Put your own where step() is.

       L di/dt = v − R i,   v = R i + L ω (s − i),   so   di/dt = ω (s − i)
       |ds/dt| ≤ S = (V − R I)/L,   s → clip(u/c, ± I),   H = c i

   i coil current (A), v voltage (V), R, L coil, V supply, I current limit, ω bandwidth (rad/s), s the current loop's target,
   u commanded and H coil field (A/m), c field per current (1/m). |s − i| stays below S/ω, hence |v| below R I + L S = V: with
   this slew the supply always suffices, and the loop is linear. The field's limits are c I and c S.
   Time: token k comes at t_k, computing takes its tick, so it acts from t_k+1 on: the answer to it, the field at t_k+1, is made
   of token k−1. Within a tick s is a straight line and the step exact (T tick):
       i' = E i + (g − E) s + (1 − g) s',   E = e^(−ωT),   g = (1 − E)/(ωT)
   A command that is no finite number is replaced by the last good one, after BROKEN_S of them by zero; the next good one counts
   again. Too large a command is clipped. Latched until the process is started anew: i²t (coil too warm), where the current is
   taken to zero. So it is when the guard is silent longer than the watchdog allows, and when the process ends.
   Status: the loop's bits as in docs/interface.md, and of a driver's own bits 16 not a number, 17 i²t. */
#define _POSIX_C_SOURCE 199309L
#include <anhyst.h>
#include <math.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum {
    AMPLITUDE_LIMITED = 1 << 0,
    SLEW_LIMITED = 1 << 1,
    RAMPING = 1 << 2,
    SAFE = 1 << 3,
    NOT_A_NUMBER = 1 << 16,
    TOO_WARM = 1 << 17
};

static const double PI = 3.141592653589793;
/* So long commands that are no numbers are bridged with the last good one. */
static const double BROKEN_S = 1e-3;
/* The current counts as zero below this share of its limit. */
static const double ZERO_SHARE = 1e-6;

static volatile sig_atomic_t told_to_end;

static void on_signal(int signal) {
    (void)signal;
    told_to_end = 1;
}

typedef struct {
    double resistance_ohm, inductance_h, supply_v, current_limit_a, field_per_current_per_m, bandwidth_hz;
    double rated_current_a, thermal_time_s; /* i²t: a first-order image of the coil's heat */
    double watchdog_s;
} Constants;

static double slew_limit_a_per_s(const Constants *c) {
    return (c->supply_v - c->resistance_ohm * c->current_limit_a) / c->inductance_h;
}

typedef struct {
    Constants constants;
    double tick_s, decay, weight_to, thermal_decay;
    double good_a_per_m, due_a_per_m, broken_s;
    double target_a, current_a, heat_a2;
    uint64_t faults;
} Amplifier;

static Amplifier at_rest(Constants constants, double tick_s) {
    Amplifier amplifier = {.constants = constants, .tick_s = tick_s};
    double ticks = 2.0 * PI * constants.bandwidth_hz * tick_s;
    amplifier.decay = exp(-ticks);
    amplifier.weight_to = 1.0 + expm1(-ticks) / ticks;
    amplifier.thermal_decay = exp(-tick_s / constants.thermal_time_s);
    return amplifier;
}

static double clip(double value, double middle, double reach) {
    return fmin(fmax(value, middle - reach), middle + reach);
}

/* What a command is taken for. */
static double accepted(Amplifier *amplifier, double command_a_per_m, uint64_t *status) {
    if (isfinite(command_a_per_m)) {
        amplifier->broken_s = 0.0;
        amplifier->good_a_per_m = command_a_per_m;
        return command_a_per_m;
    }
    *status |= NOT_A_NUMBER;
    amplifier->broken_s += amplifier->tick_s;
    return amplifier->broken_s > BROKEN_S ? 0.0 : amplifier->good_a_per_m;
}

/* Takes the command of tick k; fills in the coil's field at t_k+1 and the status. */
static void step(Amplifier *amplifier, double command_a_per_m, AnhystCoilField *coil) {
    const Constants *c = &amplifier->constants;
    uint64_t status = 0;
    double due_a = amplifier->due_a_per_m / c->field_per_current_per_m;
    amplifier->due_a_per_m = accepted(amplifier, command_a_per_m, &status);
    if (amplifier->faults) due_a = 0.0;

    double clipped_a = clip(due_a, 0.0, c->current_limit_a);
    double from_a = amplifier->target_a;
    double to_a = clip(clipped_a, from_a, slew_limit_a_per_s(c) * amplifier->tick_s);
    if (clipped_a != due_a) status |= AMPLITUDE_LIMITED;
    if (to_a != clipped_a) status |= SLEW_LIMITED;
    double weight_from = 1.0 - amplifier->decay - amplifier->weight_to;
    double current_a = amplifier->decay * amplifier->current_a + weight_from * from_a + amplifier->weight_to * to_a;
    amplifier->target_a = to_a;
    amplifier->current_a = current_a;

    double square_a2 = current_a * current_a;
    amplifier->heat_a2 = square_a2 + (amplifier->heat_a2 - square_a2) * amplifier->thermal_decay;
    if (amplifier->heat_a2 > c->rated_current_a * c->rated_current_a) amplifier->faults |= TOO_WARM;
    coil->field_a_per_m = current_a * c->field_per_current_per_m;
    coil->status = status | amplifier->faults;
}

/* To zero on our own clock, whether or not anybody listens; tokens go on from `tick` if there is a handle. */
static void to_safe_field(Amplifier *amplifier, AnhystHandle *handle, uint64_t tick, const char *why) {
    double zero_a = ZERO_SHARE * amplifier->constants.current_limit_a;
    uint64_t ticks = 0;
    AnhystCoilField coil;
    do {
        coil = (AnhystCoilField){.tick = tick + ticks++};
        step(amplifier, 0.0, &coil);
        /* The first step may still begin with the last command: it is not the end yet, even from zero. */
        int safe = ticks > 1 && fabs(amplifier->target_a) <= zero_a && fabs(amplifier->current_a) <= zero_a;
        coil.status |= safe ? SAFE : RAMPING;
        if (handle) anhyst_send_coil_field(handle, &coil); /* Readers that are gone need no field. */
    } while (!(coil.status & SAFE) && ticks < 1000000);
    if (why) fprintf(stderr, "amplifier: %s: safe field reached after %.6f s\n", why, ticks * amplifier->tick_s);
}

static int failed(const char *what) {
    fprintf(stderr, "amplifier: %s: %s\n", what, anhyst_last_error());
    return 3;
}

static uint64_t now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* The next safe field; in slices, so that a request to end is seen. A slice takes longer on a busy machine: the clock counts. */
static int32_t next_token(AnhystHandle *handle, AnhystSafeField *safe, uint64_t watchdog_us) {
    uint64_t slice_us = watchdog_us < 20000 ? watchdog_us : 20000;
    uint64_t end_us = now_us() + watchdog_us;
    int32_t heard = ANHYST_SILENCE;
    while (heard == ANHYST_SILENCE && now_us() < end_us && !told_to_end)
        heard = anhyst_receive_safe_field(handle, safe, slice_us);
    return heard;
}

/* Answers every token until the run is over; 0, or 3 after an error. The current is zero afterwards, whatever ended it. */
static int serve(AnhystHandle *handle, Amplifier *amplifier) {
    uint64_t watchdog_us = (uint64_t)(amplifier->constants.watchdog_s * 1e6);
    AnhystCoilField coil = {.tick = UINT64_MAX};
    for (;;) {
        AnhystSafeField safe;
        int32_t heard = next_token(handle, &safe, watchdog_us);
        if (heard == ANHYST_END) {
            to_safe_field(amplifier, NULL, 0, NULL);
            return 0;
        }
        if (heard != ANHYST_OK) {
            int result = heard == ANHYST_SILENCE ? 3 : failed("no safe field");
            to_safe_field(amplifier, handle, coil.tick + 1, told_to_end ? "told to end" : "no token from the guard");
            return result;
        }
        coil = (AnhystCoilField){.tick = safe.tick};
        step(amplifier, safe.field_a_per_m, &coil);
        if (anhyst_send_coil_field(handle, &coil) != ANHYST_OK) {
            int result = failed("the coil's field was not sent");
            to_safe_field(amplifier, NULL, 0, "no reader");
            return result;
        }
    }
}

static double number(const char *name, double otherwise) {
    const char *text = getenv(name);
    return text && *text ? strtod(text, NULL) : otherwise;
}

/* `--supply-v 24` and so on; the first argument that is none of them, or NULL. */
static const char *take_options(Constants *c, int count, char **arguments) {
    const struct {
        const char *name;
        double *value;
    } options[] = {
        {"--resistance-ohm", &c->resistance_ohm},
        {"--inductance-h", &c->inductance_h},
        {"--supply-v", &c->supply_v},
        {"--current-limit-a", &c->current_limit_a},
        {"--field-per-current-per-m", &c->field_per_current_per_m},
        {"--bandwidth-hz", &c->bandwidth_hz},
        {"--rated-current-a", &c->rated_current_a},
        {"--thermal-time-s", &c->thermal_time_s},
    };
    for (int i = 1; i < count; i += 2) {
        double *value = NULL;
        for (size_t k = 0; k < sizeof options / sizeof *options; k++)
            if (!strcmp(arguments[i], options[k].name)) value = options[k].value;
        char *end = NULL;
        if (value && i + 1 < count) *value = strtod(arguments[i + 1], &end);
        if (!end || end == arguments[i + 1] || *end || !(isfinite(*value) && *value > 0.0)) return arguments[i];
    }
    return NULL;
}

int main(int count, char **arguments) {
    Constants constants = {
        .resistance_ohm = 1.2,
        .inductance_h = 0.9e-3,
        .supply_v = 24.0,
        .current_limit_a = 6.0,
        .field_per_current_per_m = 9000.0,
        .bandwidth_hz = 2500.0,
        .rated_current_a = 4.0,
        .thermal_time_s = 20.0,
        /* On a rig this is a few ticks. In lockstep, where time waits for the slowest, it is the run's limit. */
        .watchdog_s = number("AMPLIFIER_WATCHDOG_S", number("ANHYST_RECEIVE_LIMIT_S", 2.0)),
    };
    const char *wrong = take_options(&constants, count, arguments);
    if (wrong) {
        fprintf(stderr, "amplifier: %s is no option, or has no positive number after it\n", wrong);
        return 2;
    }
    double tick_s = number("ANHYST_TICK_S", 0.0), slew_a_per_s = slew_limit_a_per_s(&constants);
    if (!(tick_s > 0.0) || !(constants.watchdog_s > 0.0) || !(slew_a_per_s > 0.0)) {
        fprintf(stderr, "amplifier: ANHYST_TICK_S, the watchdog's time and supply − R I must be positive\n");
        return 2;
    }
    fprintf(stderr, "amplifier: (bandwidth_hz: %g, field_limit_a_per_m: %g, slew_limit_a_per_m_s: %g)\n",
            constants.bandwidth_hz, constants.field_per_current_per_m * constants.current_limit_a,
            constants.field_per_current_per_m * slew_a_per_s);
    signal(SIGTERM, on_signal);
    signal(SIGINT, on_signal);
    Amplifier amplifier = at_rest(constants, tick_s);
    AnhystHandle *handle = anhyst_open(NULL, NULL, NULL, NULL, ANHYST_READS_AMPLIFIER, 0.0);
    if (!handle) return failed("the others were not met");
    int result = serve(handle, &amplifier);
    if (anhyst_close(handle) != ANHYST_OK && result == 0) result = failed("the end was not reached");
    return result;
}
