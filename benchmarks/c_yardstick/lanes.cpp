/* The tick of tick.c for LANES runs side by side in one register: the same source, with a vector of runs for each double.
 *
 * A branch is that of the first run, as if all runs always agreed: what it gives is the most that lanes can give. Sines
 * and exponentials are those of the C library for vectors.
 */
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <type_traits>

typedef double several __attribute__((vector_size(8 * LANES)));

extern "C" {
#if LANES == 4
several _ZGVdN4v_sin(several);
several _ZGVdN4v_cos(several);
several _ZGVdN4v_exp(several);
#define OF_LANES(name) _ZGVdN4v_##name
#else
several _ZGVeN8v_sin(several);
several _ZGVeN8v_cos(several);
several _ZGVeN8v_exp(several);
#define OF_LANES(name) _ZGVeN8v_##name
#endif
}

struct lane {
    several v;
    lane() : v{} {}
    lane(several own) : v(own) {}
    template <class T, class = typename std::enable_if<std::is_arithmetic<T>::value || std::is_enum<T>::value>::type> lane(T x) : v{} { v = v + (double)x; }
    explicit operator int() const { return (int)v[0]; }
    explicit operator long() const { return (long)v[0]; }
    lane operator-() const { return lane(-v); }
    lane &operator+=(lane b) { v += b.v; return *this; }
    lane &operator-=(lane b) { v -= b.v; return *this; }
    lane &operator*=(lane b) { v *= b.v; return *this; }
    lane &operator/=(lane b) { v /= b.v; return *this; }
};

#define ONE static inline __attribute__((always_inline))
ONE lane operator+(lane a, lane b) { return lane(a.v + b.v); }
ONE lane operator-(lane a, lane b) { return lane(a.v - b.v); }
ONE lane operator*(lane a, lane b) { return lane(a.v * b.v); }
ONE lane operator/(lane a, lane b) { return lane(a.v / b.v); }
ONE bool operator<(lane a, lane b) { return a.v[0] < b.v[0]; }
ONE bool operator>(lane a, lane b) { return a.v[0] > b.v[0]; }
ONE bool operator<=(lane a, lane b) { return a.v[0] <= b.v[0]; }
ONE bool operator>=(lane a, lane b) { return a.v[0] >= b.v[0]; }
ONE bool operator==(lane a, lane b) { return a.v[0] == b.v[0]; }
ONE lane sin(lane a) { return lane(OF_LANES(sin)(a.v)); }
ONE lane cos(lane a) { return lane(OF_LANES(cos)(a.v)); }
ONE lane exp(lane a) { return lane(OF_LANES(exp)(a.v)); }
#define EACH(name) \
    ONE lane name(lane a) { \
        for (int i = 0; i < LANES; ++i) a.v[i] = std::name(a.v[i]); \
        return a; \
    }
EACH(sqrt)
EACH(fabs)
EACH(floor)
EACH(exp2)
ONE lane fmod(lane a, lane b) {
    for (int i = 0; i < LANES; ++i) a.v[i] = std::fmod(a.v[i], b.v[i]);
    return a;
}
static void *zeros(std::size_t count, std::size_t size) {
    void *place = std::aligned_alloc(64, (count * size + 63) / 64 * 64);
    return place ? std::memset(place, 0, count * size) : place;
}

namespace runs {
#define calloc zeros
#define double lane
#include "tick.c"
#undef double
#undef calloc
} // namespace runs

static lane *spread(const double *values, unsigned long count) {
    lane *all = (lane *)zeros(count, sizeof(lane));
    for (unsigned long i = 0; i < count; ++i) all[i] = lane(values[i]);
    return all;
}

extern "C" unsigned long bench_numbers(void) { return sizeof(runs::numbers) / sizeof(lane); }
extern "C" void *bench_new(const double *values, const double *weights) {
    lane *numbers = spread(values, bench_numbers()), *net = spread(weights, runs::WEIGHTS);
    runs::bench *bench = runs::bench_new(numbers, net);
    std::free(numbers);
    std::free(net);
    return bench;
}
/* Rows of all runs are written, those of the first are handed out. */
extern "C" void bench_march(void *bench, long k, long ticks, const double *noise, double *out, long width) {
    alignas(64) static lane row[256];
    for (long i = 0; i < ticks; ++i) {
        runs::tick((runs::bench *)bench, k + i, lane(noise[i]), row);
        for (long j = 0; j < width; ++j) out[i * width + j] = row[j].v[0];
    }
}
