/* A switching current amplifier in C: takes the simulated amplifier's place in an anhyst run. Put your own where step() is.

       L di/dt = v − R i,  |v| ≤ V,  v = R i* + L ωc (i* − i) with i* = clip(field / c, ± I),  H = c i

   i coil current (A), v voltage (V), R, L coil, V supply, I current limit, c field per current (1/m), ωc bandwidth (rad/s).
   Within a tick v is constant and the step exact: i' = i e^(−T R/L) + v/R (1 − e^(−T R/L)).
   Fault states, latched: i²t (coil too warm) and a command that is no number. In both, and when the guard is silent
   longer than the watchdog allows or the process is told to end, the current is taken to zero at the rate that the supply gives.
   Status: bit 0 current limit, bit 1 supply limit, and of a driver's own bits 16 not a number, 17 i²t, 18 watchdog. */
#include <anhyst.h>
#include <math.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    CURRENT_LIMITED = 1 << 0,
    SUPPLY_LIMITED = 1 << 1,
    NOT_A_NUMBER = 1 << 16,
    TOO_WARM = 1 << 17,
    SILENT = 1 << 18,
    FAULTS = NOT_A_NUMBER | TOO_WARM | SILENT
};

static volatile sig_atomic_t told_to_end;

static void on_signal(int signal) {
    (void)signal;
    told_to_end = 1;
}

typedef struct {
    double resistance_ohm, inductance_h, supply_v, current_limit_a, field_per_current_per_m, bandwidth_rad_per_s;
    double rated_current_a, thermal_time_s; /* i²t: a first-order image of the coil's heat */
} Constants;

typedef struct {
    Constants constants;
    double tick_s, decay, thermal_decay;
    double current_a, heat_a2;
    uint64_t faults;
} Amplifier;

static Amplifier at_rest(Constants constants, double tick_s) {
    Amplifier amplifier = {.constants = constants, .tick_s = tick_s};
    amplifier.decay = exp(-tick_s * constants.resistance_ohm / constants.inductance_h);
    amplifier.thermal_decay = exp(-tick_s / constants.thermal_time_s);
    return amplifier;
}

static double clip(double value, double limit) { return fmin(fmax(value, -limit), limit); }

/* One tick towards a field; returns the status. The field is afterwards current_a * field_per_current_per_m. */
static uint64_t step(Amplifier *amplifier, double wanted_a_per_m) {
    const Constants *c = &amplifier->constants;
    if (!isfinite(wanted_a_per_m)) amplifier->faults |= NOT_A_NUMBER;
    uint64_t status = amplifier->faults;
    double wanted_a = status & FAULTS ? 0.0 : wanted_a_per_m / c->field_per_current_per_m;
    double limited_a = clip(wanted_a, c->current_limit_a);
    if (limited_a != wanted_a) status |= CURRENT_LIMITED;

    double wanted_v = c->resistance_ohm * limited_a +
                      c->inductance_h * c->bandwidth_rad_per_s * (limited_a - amplifier->current_a);
    double voltage_v = clip(wanted_v, c->supply_v);
    if (voltage_v != wanted_v) status |= SUPPLY_LIMITED;
    amplifier->current_a =
        amplifier->current_a * amplifier->decay + voltage_v / c->resistance_ohm * (1.0 - amplifier->decay);

    double square_a2 = amplifier->current_a * amplifier->current_a;
    amplifier->heat_a2 = square_a2 + (amplifier->heat_a2 - square_a2) * amplifier->thermal_decay;
    if (amplifier->heat_a2 > c->rated_current_a * c->rated_current_a) amplifier->faults |= TOO_WARM;
    return status | amplifier->faults;
}

/* What the watchdog does with a real coil: to zero on our own clock, whether or not anybody listens. */
static void to_safe_field(Amplifier *amplifier) {
    amplifier->faults |= SILENT;
    int ticks = 0;
    while (fabs(amplifier->current_a) > 1e-6 * amplifier->constants.current_limit_a && ticks < 1000000) {
        step(amplifier, 0.0);
        ticks++;
    }
    fprintf(stderr, "amplifier: %s: safe field reached after %.6f s\n",
            told_to_end ? "told to end" : "no token from the guard", ticks * amplifier->tick_s);
}

static double number(const char *name, double otherwise) {
    const char *text = getenv(name);
    return text && *text ? strtod(text, NULL) : otherwise;
}

static int failed(const char *what) {
    fprintf(stderr, "amplifier: %s: %s\n", what, anhyst_last_error());
    return 3;
}

/* The next safe field; in slices, so that a request to end is seen. */
static int32_t next_token(AnhystHandle *handle, AnhystSafeField *safe, uint64_t watchdog_us) {
    uint64_t slice_us = watchdog_us < 20000 ? watchdog_us : 20000;
    for (uint64_t waited_us = 0; waited_us < watchdog_us && !told_to_end; waited_us += slice_us) {
        int32_t heard = anhyst_receive_safe_field(handle, safe, slice_us);
        if (heard != ANHYST_SILENCE) return heard;
    }
    return ANHYST_SILENCE;
}

/* Answers every token until the run is over; 0, or 3 after an error. */
static int serve(AnhystHandle *handle, Amplifier *amplifier, uint64_t watchdog_us) {
    for (;;) {
        AnhystSafeField safe;
        int32_t heard = next_token(handle, &safe, watchdog_us);
        if (heard == ANHYST_END) return 0;
        if (heard == ANHYST_SILENCE) {
            to_safe_field(amplifier);
            return 3;
        }
        if (heard != ANHYST_OK) {
            to_safe_field(amplifier);
            return failed("no safe field");
        }
        AnhystCoilField coil = {.tick = safe.tick};
        coil.status = step(amplifier, safe.field_a_per_m);
        coil.field_a_per_m = amplifier->current_a * amplifier->constants.field_per_current_per_m;
        if (anhyst_send_coil_field(handle, &coil) != ANHYST_OK) {
            to_safe_field(amplifier);
            return failed("the coil's field was not sent");
        }
    }
}

int main(void) {
    Constants constants = {
        .resistance_ohm = 1.2,
        .inductance_h = 0.9e-3,
        .supply_v = 60.0,
        .current_limit_a = 6.0,
        .field_per_current_per_m = 9000.0,
        .bandwidth_rad_per_s = 2.0 * 3.141592653589793 * 2500.0,
        .rated_current_a = 4.0,
        .thermal_time_s = 20.0,
    };
    double tick_s = number("ANHYST_TICK_S", 0.0);
    /* On a rig this is a few ticks. In lockstep, where time waits for the slowest, it is the run's limit. */
    double watchdog_s = number("AMPLIFIER_WATCHDOG_S", number("ANHYST_RECEIVE_LIMIT_S", 2.0));
    if (!(tick_s > 0.0) || !(watchdog_s > 0.0)) {
        fprintf(stderr, "amplifier: ANHYST_TICK_S and the watchdog's time must be positive\n");
        return 2;
    }
    signal(SIGTERM, on_signal);
    signal(SIGINT, on_signal);
    Amplifier amplifier = at_rest(constants, tick_s);
    AnhystHandle *handle = anhyst_open(NULL, NULL, NULL, NULL, ANHYST_READS_AMPLIFIER, 0.0);
    if (!handle) return failed("the others were not met");
    int result = serve(handle, &amplifier, (uint64_t)(watchdog_s * 1e6));
    if (anhyst_close(handle) != ANHYST_OK && result == 0) result = failed("the end was not reached");
    return result;
}
