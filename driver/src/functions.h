/* Results. Negative: an error; anhyst_last_error() has the sentence. */
#define ANHYST_OK 0
#define ANHYST_SILENCE 1      /* nothing within the time-out */
#define ANHYST_END 2          /* the run is over: close */
#define ANHYST_GAP (-1)       /* a token of another tick came: it is in `token`, tokens before it were lost */
#define ANHYST_UNDELIVERED (-2) /* a reader is gone */
#define ANHYST_ABSENT (-3)    /* a process did not come in time */
#define ANHYST_BAD_ARGUMENT (-4)
#define ANHYST_TRANSPORT (-5) /* shared memory refused */
#define ANHYST_PANIC (-6)     /* a fault of the library; the handle can only be closed */

/* A process's place in the loop. To be used by one thread only, the one that opened it. */
typedef struct AnhystHandle AnhystHandle;

/* Opens the process's channels and meets all others; when it returns, tick 0 may begin. Use anhyst_open below.
   process, prefix, root, processes: NULL takes ANHYST_PROCESS, ANHYST_SERVICE_PREFIX, ANHYST_ROOT, ANHYST_PROCESSES from the
   environment; without the last each node has a process of its own. reads: ANHYST_READS_… of the node, or a sum of
   1u << ANHYST_… . It sends on every channel that its nodes produce. start_limit_s: how long to wait for the others;
   0 takes ANHYST_START_LIMIT_S, or 60 s. NULL on error. */
AnhystHandle *anhyst_open_checked(const char *process, const char *prefix, const char *root, const char *processes,
                                  uint32_t reads, double start_limit_s, uint64_t layouts);

/* Waits at most timeout_us for the channel's next token and copies it to `token`: ANHYST_OK, _SILENCE, _END or an error.
   In real time (ANHYST_CLOCK is not lockstep) it waits for a token newer than the one taken last and takes the newest: those
   between are dropped, which is no error. Answer with its tick. A plant takes what is there: timeout_us 0. */
int32_t anhyst_receive(AnhystHandle *handle, uint32_t channel, void *token, uint64_t timeout_us);

/* In real time: sleeps until tick `tick` begins on CLOCK_MONOTONIC; in lockstep it returns at once. For a plant without a timer
   of its own; the first call of a plant says that tick 0 begins in 20 ms. A plant with a timer does not call it: then tick 0
   begins with the first measurement that it sends. ANHYST_OK or an error. */
int32_t anhyst_wait_for_tick(AnhystHandle *handle, uint64_t tick);

/* Sends a copy of `token` to every reader; `sent_ns` is set by the library. ANHYST_OK or an error. In real time a reader that
   is gone is none: it may come back, or the launcher ends the run. */
int32_t anhyst_send(AnhystHandle *handle, uint32_t channel, const void *token);

/* Leaves the loop and frees the handle, which may be NULL. After ANHYST_END it waits for the others to finish. */
int32_t anhyst_close(AnhystHandle *handle);

/* The last error of this thread, a sentence; empty if there was none. Valid until the thread's next call. */
const char *anhyst_last_error(void);

static inline AnhystHandle *anhyst_open(const char *process, const char *prefix, const char *root, const char *processes,
                                        uint32_t reads, double start_limit_s) {
    return anhyst_open_checked(process, prefix, root, processes, reads, start_limit_s, ANHYST_LAYOUTS);
}
