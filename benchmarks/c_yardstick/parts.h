/* The numbers of a loop, in the order in which the driver lays them out; all are doubles. */
#ifndef PARTS_H
#define PARTS_H

#include "vector.h"

typedef struct { double b0, b1, b2, a1, a2, rate; } biquad;
typedef struct { v3 length, mass, com, moment, limits, rotor; } arm_t;
typedef struct { v3 sigma0, sigma1, sigma2, coulomb, fixed, stribeck; double asymmetry; } friction_t;
typedef struct { double stiffness, damping, mass; } surface_t;
typedef struct { double stiffness, damping, friction; } side_t;
typedef struct { double mobility, frequency, damping; } mode_t;
typedef struct { double bits, full_scale; } converter;
typedef struct { double bits; v3 full_scale; } converter3;
typedef struct { v3 theta; m3 P; double forgetting; } squares_t;

typedef struct {
    v3 start;
    arm_t arm;
    friction_t friction;
    surface_t surface;
    side_t side;
    double wall;
    mode_t mode;
    double beyond;
    v3 counts, offset;
    biquad analog1, analog2;
    converter sensor;
    double noise, sampling, rate, shift;
    biquad line;
    double filtered;
    converter input;
    double roughness;
    converter3 output;
    arm_t model;
    biquad motion, smooth;
    double conditioning_tick;
    double approach_start, hold, first, step, period, switch_at, release, wait, sequence_tick;
    double force_first, force_second, force_period, amplitude, frequency, restart;
    v3 approach_kp, approach_kv;
    v3 kp, kv, kf, pose_offset;
    v3 outputs;
    double learning_rate;
    v3 compensation, blend;
    squares_t thesis, raw, matched;
    biquad front2, front1;
    double delay, delay_rate, g, damping, front_rate;
    double centring, touch;
    double tick, steps;
    v3 q;
} numbers;

typedef struct { double s1, s2; } memory;
typedef struct { v3 s1, s2; } memory3;

INLINE memory at_rest(const biquad *f, double u) {
    double y = (f->b0 + f->b1 + f->b2) / (1.0 + f->a1 + f->a2) * u, s2 = f->b2 * u - f->a2 * y;
    memory m = {f->b1 * u - f->a1 * y + s2, s2};
    return m;
}
INLINE double filter(const biquad *f, memory *m, double u) {
    double y = f->b0 * u + m->s1;
    m->s1 = f->b1 * u - f->a1 * y + m->s2;
    m->s2 = f->b2 * u - f->a2 * y;
    return y;
}
INLINE v3 filter3(const biquad *f, memory3 *m, v3 u) {
    v3 y = add(scale(f->b0, u), m->s1);
    m->s1 = add(sub(scale(f->b1, u), scale(f->a1, y)), m->s2);
    m->s2 = sub(scale(f->b2, u), scale(f->a2, y));
    return y;
}
INLINE double resolution(double full_scale, double bits) { return full_scale / exp2(bits - 1.0); }
INLINE double convert(double u, double full_scale, double code) { return clip(whole(u / code) * code, full_scale - code); }

#endif
