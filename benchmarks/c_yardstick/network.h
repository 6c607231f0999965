/* The 9-12-3 network: forward, back-propagation, and the gain of its first output. */
#ifndef NETWORK_H
#define NETWORK_H

#include <string.h>

#include "parts.h"

enum { INPUTS = 9, HIDDEN = 12, OUTPUTS = 3, WEIGHTS = HIDDEN * (INPUTS + 1) + OUTPUTS * (HIDDEN + 1) };

typedef struct {
    double hidden[HIDDEN][INPUTS + 1], output[OUTPUTS][HIDDEN + 1];
    double in[INPUTS], between[HIDDEN], out[OUTPUTS];
} network;

INLINE double sigmoid(double u) {
    double e = exp(-fabs(u)), s = (1.0 - e) / (1.0 + e);
    return u >= 0.0 ? s : -s;
}
INLINE double slope(double s) { return 0.5 * (1.0 - s * s); }

static void forward(network *n) {
    for (int j = 0; j < HIDDEN; j++) {
        double u = n->hidden[j][0];
        for (int i = 0; i < INPUTS; i++) u += n->hidden[j][1 + i] * n->in[i];
        n->between[j] = sigmoid(u);
    }
    for (int j = 0; j < OUTPUTS; j++) {
        double u = n->output[j][0];
        for (int i = 0; i < HIDDEN; i++) u += n->output[j][1 + i] * n->between[i];
        n->out[j] = sigmoid(u);
    }
}
INLINE void backward(const network *n, const double *error, const double *amplitude, double *d_out, double *d_between) {
    for (int k = 0; k < OUTPUTS; k++) d_out[k] = error[k] * amplitude[k] * slope(n->out[k]);
    for (int i = 0; i < HIDDEN; i++) {
        double e = 0.0;
        for (int k = 0; k < OUTPUTS; k++) e += d_out[k] * n->output[k][1 + i];
        d_between[i] = e * slope(n->between[i]);
    }
}
static void learn(network *n, const double *error, const double *amplitude, double rate) {
    double d_out[OUTPUTS], d_between[HIDDEN];
    backward(n, error, amplitude, d_out, d_between);
    for (int j = 0; j < HIDDEN; j++) {
        double d = rate * d_between[j];
        n->hidden[j][0] += d;
        for (int i = 0; i < INPUTS; i++) n->hidden[j][1 + i] += d * n->in[i];
    }
    for (int j = 0; j < OUTPUTS; j++) {
        double d = rate * d_out[j];
        n->output[j][0] += d;
        for (int i = 0; i < HIDDEN; i++) n->output[j][1 + i] += d * n->between[i];
    }
}
static double gain(const network *n, const double *amplitude, double rate) {
    const double first[OUTPUTS] = {1.0};
    double d_out[OUTPUTS], d_between[HIDDEN], into = 1.0, total = 0.0;
    backward(n, first, amplitude, d_out, d_between);
    for (int i = 0; i < INPUTS; i++) into += n->in[i] * n->in[i];
    for (int j = 0; j < HIDDEN; j++) total += into * d_between[j] * d_between[j];
    into = 1.0;
    for (int i = 0; i < HIDDEN; i++) into += n->between[i] * n->between[i];
    for (int j = 0; j < OUTPUTS; j++) total += into * d_out[j] * d_out[j];
    return rate * total;
}
INLINE double norm(const double *w, int n) {
    double total = 0.0;
    for (int i = 0; i < n; i++) total += w[i] * w[i];
    return sqrt(total);
}

#endif
