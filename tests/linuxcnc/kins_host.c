/* What a kinematics module of LinuxCNC asks of its host: memory and pins, which a test reads and sets by name. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST 256
static char names[MOST][64];
static void *values[MOST];
static int count;

static int pin(void **address, const char *format, va_list rest) {
    if (count >= MOST) return -1;
    vsnprintf(names[count], sizeof names[count], format, rest);
    *address = values[count++] = calloc(1, 16);
    return 0;
}

#define PIN(kind) \
    int hal_pin_##kind##_newf(int way, void **address, int owner, const char *format, ...) { \
        va_list rest; va_start(rest, format); int r = pin(address, format, rest); va_end(rest); return r; } \
    static int kind##_plain(void **address, const char *format, ...) { \
        va_list rest; va_start(rest, format); int r = pin(address, format, rest); va_end(rest); return r; } \
    int hal_pin_##kind##_new(const char *name, int way, void **address, int owner) { \
        return kind##_plain(address, "%s", name); }
PIN(float) PIN(bit) PIN(s32) PIN(u32)

/* parameters, whose memory is the module's own */
#define PARAM(kind) \
    int hal_param_##kind##_newf(int way, void *address, int owner, const char *format, ...) { \
        if (count >= MOST) return -1; \
        va_list rest; va_start(rest, format); vsnprintf(names[count], sizeof names[count], format, rest); va_end(rest); \
        values[count++] = address; return 0; }
PARAM(float) PARAM(bit) PARAM(s32) PARAM(u32)

int hal_init(const char *name) { return 1; }
int hal_ready(int owner) { return 0; }
int hal_exit(int owner) { return 0; }
void *hal_malloc(long size) { return calloc(1, size); }
void rtapi_print(const char *text, ...) {}
void rtapi_print_msg(int level, const char *text, ...) {}
double *host_pin(const char *name) {
    for (int k = count - 1; k >= 0; k--) if (!strcmp(names[k], name)) return values[k];
    return 0;
}
const char *host_name(int k) { return k < count ? names[k] : 0; }
