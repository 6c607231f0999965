/* Least squares on a root of the covariance, and the front-end that matches the channels' lags. */
#ifndef SQUARES_H
#define SQUARES_H

#include "parts.h"

enum { BLOCK = 100 };

typedef struct {
    v3 theta;
    m3 root, left, passed, heard;
    v3 added;
    double weight, squares, products, last, blocks, filled;
} squares_state;

static const m3 IDENTITY = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};

INLINE squares_state squares_start(const squares_t *n) {
    m3 P = n->P;
    double a = sqrt(P.r1.x), b = P.r2.x / a, d = P.r3.x / a, c = sqrt(P.r2.y - b * b), e = (P.r3.y - d * b) / c;
    squares_state s = {0};
    s.theta = n->theta;
    s.root = s.left = mat(vec(a, 0.0, 0.0), vec(b, c, 0.0), vec(d, e, sqrt(P.r3.z - d * d - e * e)));
    s.passed = IDENTITY;
    return s;
}
INLINE m3 held(m3 S, v3 row, double floor) {
    double q = dot(row, row), excess = q * floor;
    if (!(excess > 1.0 && q > 0.0)) return S;
    return madd(S, outer(scale((1.0 / sqrt(excess) - 1.0) / q, times(S, row)), row));
}
static void squares_step(const squares_t *n, squares_state *s, v3 phi, double y) {
    m3 S = s->root;
    double keep = n->forgetting;
    v3 floor = vec(1.0 / n->P.r1.x, 1.0 / n->P.r2.y, 1.0 / n->P.r3.z);
    v3 wide = vec(dot(S.r1, S.r1), dot(S.r2, S.r2), dot(S.r3, S.r3));
    if (dot(wide, floor) > 3.0 || wide.x + wide.y + wide.z > n->P.r1.x + n->P.r2.y + n->P.r3.z) {
        S = held(S, S.r1, floor.x);
        S = held(S, S.r2, floor.y);
        S = held(S, S.r3, floor.z);
    }
    S = mscale(1.0 / sqrt(keep), S);
    v3 f = transposed_times(S, phi);
    double a = 1.0 + dot(f, f), e = y - dot(phi, s->theta);
    v3 k = times(S, f), gain = scale(1.0 / a, k);
    s->theta = add(s->theta, scale(e, gain));
    s->root = msub(S, outer(scale(1.0 / (a + sqrt(a)), k), f));
    e /= sqrt(a);
    s->passed = msub(s->passed, outer(gain, transposed_times(s->passed, phi)));
    s->added = add(s->added, scale(e - dot(phi, s->added), gain));
    s->blocks *= keep * keep;
    s->filled += 1.0;
    if (s->filled >= BLOCK) {
        s->left = product(s->passed, s->left);
        s->heard = madd(product_transposed(product(s->passed, s->heard), s->passed), outer(s->added, s->added));
        s->passed = IDENTITY;
        s->added = vec(0.0, 0.0, 0.0);
        s->blocks += 1.0;
        s->filled = 0.0;
    }
    s->weight = keep * s->weight + 1.0;
    s->squares = keep * s->squares + e * e;
    s->products = keep * s->products + e * s->last;
    s->last = e;
}
static v3 squares_std(const squares_state *s) {
    double noise = 0.0;
    if (s->squares > 0.0) {
        double r = s->products / s->squares, n = s->weight - 3.0;
        r = r > 0.99 ? 0.99 : r < 0.0 ? 0.0 : r;
        noise = s->squares / (n > 1.0 ? n : 1.0) * (1.0 + r) / (1.0 - r);
    }
    m3 left = product(s->passed, s->left), heard = product(s->passed, s->heard);
    double own = 2.0 * noise, share = 1.0 / (2.0 + s->blocks);
    const v3 *S = &s->root.r1, *L = &left.r1, *H = &heard.r1, *A = &s->passed.r1;
    const double *added = &s->added.x;
    double C[3];
    for (int i = 0; i < 3; i++) {
        double h = dot(H[i], A[i]) + added[i] * added[i];
        C[i] = sqrt(dot(L[i], L[i]) + share * (own * dot(S[i], S[i]) + s->blocks * h));
    }
    return vec(C[0], C[1], C[2]);
}

typedef struct { double i1, i2; } integrators;
typedef struct { double value, rate, second; } channel;
typedef struct { memory second, first; double history[10]; integrators position, force; } front_state;
typedef struct { v3 mean; double force, weight; } centring_state;

INLINE channel variable(const numbers *n, integrators *s, double u) {
    double g = n->g, w = 2.0 * n->front_rate * g, high = 1.0 / (1.0 + g * (g + n->damping)) * (u - (n->damping + g) * s->i1 - s->i2);
    double band = g * high + s->i1, low = g * band + s->i2;
    s->i1 = g * high + band;
    s->i2 = g * band + low;
    channel c = {low, w * band, w * w * high};
    return c;
}
INLINE double delayed(double *history, double samples, double u) {
    for (int i = 9; i > 0; i--) history[i] = history[i - 1];
    history[0] = u;
    int i = (int)samples;
    if (i > 8) i = 8;
    double part = samples - i;
    return (1.0 - part) * history[i] + part * history[i + 1];
}
INLINE v3 front_step(const numbers *n, front_state *s, double x, double *force) {
    double late = filter(&n->front1, &s->first, filter(&n->front2, &s->second, x));
    channel c = variable(n, &s->position, delayed(s->history, n->delay, late));
    *force = variable(n, &s->force, *force).value;
    return vec(c.second, c.rate, c.value);
}
INLINE v3 centre(double forgetting, centring_state *s, v3 phi, double *y) {
    double weight = forgetting * s->weight, size = sqrt(weight / (weight + 1.0)), dy = *y - s->force;
    v3 d = sub(phi, s->mean);
    s->mean = add(s->mean, over(d, weight + 1.0));
    s->force += dy / (weight + 1.0);
    s->weight = weight + 1.0;
    *y = size * dy;
    return scale(size, d);
}

#endif
