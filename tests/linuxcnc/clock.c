/* A clock that runs WARP (a number, or a fraction as 3/4) times faster for every process that preloads this: the time of
 * day counts from EPOCH, the monotonic clock from 0, so that all processes agree without talking; sleeps and time-outs
 * shrink by WARP. Threads may run on every processor.
 * gcc -O2 -shared -fPIC -o clock.so clock.c */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/select.h>
#include <sys/sem.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

typedef long long nanos;
enum { SECOND = 1000000000LL };
static const nanos EPOCH = 1700000000LL * SECOND;
static nanos warp = 1, over = 1;

#define REAL(name) __typeof__(&name) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static nanos from(const struct timespec *t) { return t->tv_sec * SECOND + t->tv_nsec; }
static struct timespec to(nanos n) { return (struct timespec){n / SECOND, n % SECOND}; }

/* Only clocks that somebody waits for are changed; processor time stays what it is. */
static int warped(clockid_t id) { return id != CLOCK_PROCESS_CPUTIME_ID && id != CLOCK_THREAD_CPUTIME_ID; }
static nanos origin(clockid_t id) { return id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE ? EPOCH : 0; }

/* The kernel's habit of waking sleepers up to 50 us late would be half a servo period here. */
__attribute__((constructor)) static void start(void) {
    const char *text = getenv("WARP");
    const char *bar = text ? strchr(text, '/') : NULL;
    if (text && atoll(text) > 1) warp = atoll(text);
    if (bar && atoll(bar + 1) > 1) over = atoll(bar + 1);
    prctl(PR_SET_TIMERSLACK, 1000UL, 0, 0, 0);
}

int clock_gettime(clockid_t id, struct timespec *t) {
    static __typeof__(&clock_gettime) real;
    if (!real) real = (__typeof__(real))dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(id, t);
    if (!failed && warped(id)) *t = to(origin(id) + (from(t) - origin(id)) / over * warp);
    return failed;
}

int gettimeofday(struct timeval *restrict t, void *restrict zone) {
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    t->tv_sec = now.tv_sec;
    t->tv_usec = now.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *t) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (t) *t = now.tv_sec;
    return now.tv_sec;
}

int clock_nanosleep(clockid_t id, int flags, const struct timespec *wanted, struct timespec *left) {
    REAL(clock_nanosleep);
    nanos start = flags & TIMER_ABSTIME ? origin(id) : 0;
    struct timespec t = to(start + (from(wanted) - start) / warp * over);
    return real(id, flags, &t, left);
}

int nanosleep(const struct timespec *wanted, struct timespec *left) {
    REAL(nanosleep);
    struct timespec t = to(from(wanted) / warp * over);
    return real(&t, left);
}

/* Without files it is a sleep, and pselect keeps its nanoseconds. */
int select(int n, fd_set *restrict in, fd_set *restrict out, fd_set *restrict bad, struct timeval *restrict wait) {
    if (!wait) return pselect(n, in, out, bad, NULL, NULL);
    struct timespec t = to((wait->tv_sec * SECOND + wait->tv_usec * 1000) / warp * over);
    return pselect(n, in, out, bad, &t, NULL);
}

int semtimedop(int id, struct sembuf *ops, size_t count, const struct timespec *wait) {
    REAL(semtimedop);
    if (!wait) return real(id, ops, count, NULL);
    struct timespec t = to(from(wait) / warp * over + 1000);
    return real(id, ops, count, &t);
}

/* LinuxCNC ties its servo thread to one processor; on a shared host that one may be busy while another is free. */
int pthread_attr_setaffinity_np(pthread_attr_t *attributes, size_t size, const cpu_set_t *processors) {
    (void)attributes, (void)size, (void)processors;
    return 0;
}

/* A session of its own would be a scheduling group of its own (autogroup), and some kernels starve such small groups for
 * seconds beside busy ones. */
pid_t setsid(void) { return getpid(); }

/* What LinuxCNC writes is thrown away after the run; waiting for the disk would only hold the program up. */
int fsync(int file) {
    (void)file;
    return 0;
}

int fdatasync(int file) {
    (void)file;
    return 0;
}
